/* The scenes that `veduta-bench export` writes; the format is told in benches/src/exchange.rs. */
#ifndef VEDUTA_PEERS_SCENE_H
#define VEDUTA_PEERS_SCENE_H

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* Seen from behind as well as from the front. */
#define DOUBLE_SIDED 1

typedef struct {
    uint32_t vertices, triangles, perspective;
    double clip_from_eye[16]; /* by rows */
    double *position;         /* 3 a vertex: eye space, x right, y down, z forward */
    uint32_t *corner;         /* 3 a triangle, counterclockwise seen from its front */
    float *color;             /* 3 a triangle: linear light */
    uint8_t *flags;           /* 1 a triangle */
} Scene;

static void fail(const char *what, const char *name)
{
    fprintf(stderr, "%s: %s\n", what, name);
    exit(1);
}

static void *read_table(FILE *file, size_t bytes, const char *path)
{
    void *table = malloc(bytes ? bytes : 1);
    if (!table || fread(table, 1, bytes, file) != bytes)
        fail("ends too early, or does not fit into memory", path);
    return table;
}

static Scene read_scene(const char *path)
{
    FILE *file = fopen(path, "rb");
    char magic[8];
    Scene scene;
    if (!file)
        fail("cannot open", path);
    if (fread(magic, 1, 8, file) != 8 || memcmp(magic, "VPEERS1\n", 8) != 0)
        fail("is not an exported scene", path);
    if (fread(&scene.vertices, 4, 3, file) != 3 || fseek(file, 4, SEEK_CUR) != 0
        || fread(scene.clip_from_eye, 8, 16, file) != 16)
        fail("ends too early", path);
    scene.position = (double *)read_table(file, (size_t)scene.vertices * 24, path);
    scene.corner = (uint32_t *)read_table(file, (size_t)scene.triangles * 12, path);
    scene.color = (float *)read_table(file, (size_t)scene.triangles * 12, path);
    scene.flags = (uint8_t *)read_table(file, scene.triangles, path);
    fclose(file);
    return scene;
}

static void free_scene(Scene *scene)
{
    free(scene->position);
    free(scene->corner);
    free(scene->color);
    free(scene->flags);
}

/* CPU seconds of this process, user and system, of all its threads. */
static double cpu_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Writes height x width x 3 floats, rows from the top, as NPY. */
static void write_picture(const char *path, const float *rgb, int width, int height)
{
    char header[128];
    FILE *file = fopen(path, "wb");
    size_t values = (size_t)width * height * 3;
    if (!file)
        fail("cannot write", path);
    memset(header, ' ', sizeof header);
    memcpy(header, "\x93NUMPY\x01\x00\x76\x00", 10);
    header[10 + snprintf(header + 10, 117,
                         "{'descr': '<f4', 'fortran_order': False, 'shape': (%d, %d, 3), }",
                         height, width)] = ' ';
    header[127] = '\n';
    if (fwrite(header, 1, 128, file) != 128 || fwrite(rgb, 4, values, file) != values || fclose(file))
        fail("cannot write", path);
}

/* A render is repeated until it has taken this long in all, or this often. */
#define PATIENCE_SECONDS 0.4
#define MOST_REPEATS 9

#endif
