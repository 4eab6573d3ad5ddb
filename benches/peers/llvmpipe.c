/* Mesa's software OpenGL (llvmpipe), supersampled n x n.
 *
 *   llvmpipe SCENE WIDTH HEIGHT N [--half] [--tile SAMPLES] [--no-color] [--picture OUT.npy]
 *
 * Draws WIDTH*N x HEIGHT*N samples, in tiles if there are many, and means them to pixels in linear
 * light. N = 0 draws a sample for each pixel and stops at the depth buffer and its colours: no
 * reading back, no picture; with --no-color depth alone. Prints CPU seconds as JSON: "load" is
 * reading the file and making the buffers; "render" is the least of several rounds of drawing,
 * reading back and averaging. What Mesa needs to start and to compile shaders is not counted.
 *
 * What a good OpenGL program would do is done, since a slow rival proves nothing: shared vertices
 * (flat colours sit at each triangle's first vertex, doubled only where two triangles claim it),
 * faces turned away culled, 8-bit samples (--half: 16-bit floats, for proving that the picture
 * converges), depth that grows towards the eye in 32-bit floats, tiles that stay in the cache. */
#define _GNU_SOURCE
#define GL_GLEXT_PROTOTYPES
#define EGL_EGLEXT_PROTOTYPES
#include "scene.h"
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GL/glcorearb.h>

static int half_float = 0, no_color = 0, tile_side = 0;

static void check_gl(const char *where)
{
    GLenum error = glGetError();
    if (error != GL_NO_ERROR) {
        fprintf(stderr, "OpenGL error 0x%x: %s\n", error, where);
        exit(1);
    }
}

static void open_context(void)
{
    static const EGLint config_wish[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE,
                                         EGL_OPENGL_BIT, EGL_NONE};
    static const EGLint context_wish[] = {EGL_CONTEXT_MAJOR_VERSION, 4, EGL_CONTEXT_MINOR_VERSION, 5,
                                          EGL_NONE};
    EGLDisplay display;
    EGLConfig config = EGL_NO_CONFIG_KHR;
    EGLContext context;
    EGLint count = 0;
    /* One thread, the one that calls; software even where there is a GPU. */
    setenv("LP_NUM_THREADS", "0", 1);
    setenv("LIBGL_ALWAYS_SOFTWARE", "1", 1);
    setenv("GALLIUM_DRIVER", "llvmpipe", 1);
    setenv("MESA_SHADER_CACHE_DISABLE", "true", 1);
    display = eglGetPlatformDisplay(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, NULL);
    if (display == EGL_NO_DISPLAY || !eglInitialize(display, NULL, NULL))
        fail("EGL", "no surfaceless display");
    eglBindAPI(EGL_OPENGL_API);
    eglChooseConfig(display, config_wish, &config, 1, &count);
    context = eglCreateContext(display, count ? config : EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, context_wish);
    if (context == EGL_NO_CONTEXT
        || !eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context))
        fail("EGL", "no OpenGL 4.5 context");
    if (!strstr((const char *)glGetString(GL_RENDERER), "llvmpipe"))
        fail("not llvmpipe", (const char *)glGetString(GL_RENDERER));
}

static GLuint compile(GLenum kind, const char *text)
{
    GLuint shader = glCreateShader(kind);
    GLint done;
    glShaderSource(shader, 1, &text, NULL);
    glCompileShader(shader);
    glGetShaderiv(shader, GL_COMPILE_STATUS, &done);
    if (!done)
        fail("shader", text);
    return shader;
}

static GLuint link_program(void)
{
    GLuint program = glCreateProgram();
    glAttachShader(program, compile(GL_VERTEX_SHADER,
                                    "#version 450 core\n"
                                    "layout(location = 0) in vec3 position;\n"
                                    "layout(location = 1) in vec3 color;\n"
                                    "layout(location = 0) uniform mat4 clip_from_eye;\n"
                                    "flat out vec3 seen;\n"
                                    "void main() {\n"
                                    "    gl_Position = clip_from_eye * vec4(position, 1.0);\n"
                                    "    seen = color;\n"
                                    "}\n"));
    glAttachShader(program, compile(GL_FRAGMENT_SHADER,
                                    "#version 450 core\n"
                                    "flat in vec3 seen;\n"
                                    "out vec4 color;\n"
                                    "void main() { color = vec4(seen, 1.0); }\n"));
    glLinkProgram(program);
    return program;
}

static void push_vertex(const Scene *scene, uint32_t vertex, uint32_t row, float *positions,
                        uint8_t *bytes, float *floats, const float *color)
{
    for (int k = 0; k < 3; k++) {
        positions[3 * (size_t)row + k] = (float)scene->position[3 * (size_t)vertex + k];
        bytes[4 * (size_t)row + k] = (uint8_t)(color[k] * 255.0f + 0.5f);
        floats[3 * (size_t)row + k] = color[k];
    }
}

/* Fills the buffers; how many indices belong to faces that are seen from the front only (the first
 * ones) and from both sides. */
static void upload(const Scene *scene, GLsizei index_count[2])
{
    size_t most = (size_t)scene->vertices + scene->triangles;
    float *positions = malloc(most * 12);
    float *floats = malloc(most * 12);
    uint8_t *bytes = calloc(most, 4);
    uint32_t *indices = malloc((size_t)scene->triangles * 12);
    /* Which colour each vertex gives; the ones never claimed keep none. */
    uint32_t *claimed_by = malloc((size_t)scene->vertices * 4);
    uint32_t rows = scene->vertices;
    size_t filled = 0;
    GLuint buffers[3], array;
    if (!positions || !floats || !bytes || !indices || !claimed_by)
        fail("memory", "too little");
    memset(claimed_by, 0xff, (size_t)scene->vertices * 4);
    for (uint32_t vertex = 0; vertex < scene->vertices; vertex++)
        for (int k = 0; k < 3; k++)
            positions[3 * (size_t)vertex + k] = (float)scene->position[3 * (size_t)vertex + k];
    for (int pass = 0; pass < 2; pass++) {
        for (uint32_t triangle = 0; triangle < scene->triangles; triangle++) {
            const uint32_t *corner = scene->corner + 3 * (size_t)triangle;
            const float *color = scene->color + 3 * (size_t)triangle;
            uint32_t first;
            int k;
            if ((scene->flags[triangle] & DOUBLE_SIDED ? 1 : 0) != pass)
                continue;
            for (k = 0; k < 3; k++) {
                uint32_t by = claimed_by[corner[k]];
                if (by == UINT32_MAX || memcmp(scene->color + 3 * (size_t)by, color, 12) == 0)
                    break;
            }
            if (k < 3) {
                first = corner[k];
                claimed_by[first] = triangle;
            } else {
                k = 0;
                first = rows++;
            }
            push_vertex(scene, corner[k], first, positions, bytes, floats, color);
            indices[filled++] = first;
            indices[filled++] = corner[(k + 1) % 3];
            indices[filled++] = corner[(k + 2) % 3];
        }
        index_count[pass] = (GLsizei)(filled - (pass ? index_count[0] : 0));
    }
    glGenVertexArrays(1, &array);
    glBindVertexArray(array);
    glGenBuffers(3, buffers);
    glBindBuffer(GL_ARRAY_BUFFER, buffers[0]);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)rows * 12, positions, GL_STATIC_DRAW);
    glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 12, NULL);
    glEnableVertexAttribArray(0);
    glBindBuffer(GL_ARRAY_BUFFER, buffers[1]);
    if (half_float) {
        glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)rows * 12, floats, GL_STATIC_DRAW);
        glVertexAttribPointer(1, 3, GL_FLOAT, GL_FALSE, 12, NULL);
    } else {
        glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)rows * 4, bytes, GL_STATIC_DRAW);
        glVertexAttribPointer(1, 4, GL_UNSIGNED_BYTE, GL_TRUE, 4, NULL);
    }
    glEnableVertexAttribArray(1);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, buffers[2]);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER, (GLsizeiptr)filled * 4, indices, GL_STATIC_DRAW);
    free(positions);
    free(floats);
    free(bytes);
    free(indices);
    free(claimed_by);
}

static void draw(const GLsizei index_count[2])
{
    static const float black[4] = {0, 0, 0, 0}, far_away = 0;
    glClearBufferfv(GL_DEPTH, 0, &far_away);
    if (!no_color)
        glClearBufferfv(GL_COLOR, 0, black);
    if (index_count[0]) {
        glEnable(GL_CULL_FACE);
        glDrawElements(GL_TRIANGLES, index_count[0], GL_UNSIGNED_INT, NULL);
    }
    if (index_count[1]) {
        glDisable(GL_CULL_FACE);
        glDrawElements(GL_TRIANGLES, index_count[1], GL_UNSIGNED_INT,
                       (const void *)((size_t)index_count[0] * 4));
    }
}

/* The projection of which samples [x, x + width) x [y, y + height) of all_width x all_height fill
 * the whole target. */
static void aim(const double *clip_from_eye, double x, double y, double width, double height,
                double all_width, double all_height)
{
    float matrix[16];
    double scale_x = all_width / width, scale_y = all_height / height;
    double shift_x = (all_width - 2 * x) / width - 1, shift_y = (all_height - 2 * y) / height - 1;
    for (int k = 0; k < 4; k++) {
        matrix[k] = (float)(scale_x * clip_from_eye[k] + shift_x * clip_from_eye[12 + k]);
        matrix[4 + k] = (float)(scale_y * clip_from_eye[4 + k] + shift_y * clip_from_eye[12 + k]);
        matrix[8 + k] = (float)clip_from_eye[8 + k];
        matrix[12 + k] = (float)clip_from_eye[12 + k];
    }
    glUniformMatrix4fv(0, 1, GL_TRUE, matrix);
}

/* Adds a row of samples to a row of sums, n samples each. */
static void add_bytes(const uint8_t *restrict sample, uint32_t *restrict sum, int pixels, int n)
{
    for (int pixel = 0; pixel < pixels; pixel++, sum += 4)
        for (int k = 0; k < n; k++, sample += 4)
            for (int channel = 0; channel < 4; channel++)
                sum[channel] += sample[channel];
}

static void add_floats(const float *restrict sample, float *restrict sum, int pixels, int n)
{
    for (int pixel = 0; pixel < pixels; pixel++, sum += 4)
        for (int k = 0; k < n; k++, sample += 4)
            for (int channel = 0; channel < 4; channel++)
                sum[channel] += sample[channel];
}

typedef struct {
    int width, height, n, tile; /* tile: pixels along a side */
    void *samples;
    void *sums;
    float *rgb;
} Target;

static void render(const Scene *scene, const GLsizei index_count[2], Target *t)
{
    for (int y = 0; y < t->height; y += t->tile) {
        for (int x = 0; x < t->width; x += t->tile) {
            int columns = t->width - x < t->tile ? t->width - x : t->tile;
            int rows = t->height - y < t->tile ? t->height - y : t->tile;
            int samples_across = columns * t->n;
            glViewport(0, 0, samples_across, rows * t->n);
            aim(scene->clip_from_eye, x, y, columns, rows, t->width, t->height);
            draw(index_count);
            glReadPixels(0, 0, samples_across, rows * t->n, GL_RGBA,
                         half_float ? GL_FLOAT : GL_UNSIGNED_BYTE, t->samples);
            for (int row = 0; row < rows; row++) {
                float *out = t->rgb + ((size_t)(y + row) * t->width + x) * 3;
                float weight = 1.0f / ((float)t->n * (float)t->n * (half_float ? 1.0f : 255.0f));
                memset(t->sums, 0, (size_t)columns * 16);
                for (int k = 0; k < t->n; k++) {
                    size_t offset = ((size_t)row * t->n + k) * samples_across * 4;
                    if (half_float)
                        add_floats((float *)t->samples + offset, t->sums, columns, t->n);
                    else
                        add_bytes((uint8_t *)t->samples + offset, t->sums, columns, t->n);
                }
                for (int column = 0; column < columns; column++)
                    for (int channel = 0; channel < 3; channel++)
                        out[3 * column + channel] =
                            weight
                            * (half_float ? ((float *)t->sums)[4 * column + channel]
                                          : (float)((uint32_t *)t->sums)[4 * column + channel]);
            }
        }
    }
}

/* A depth buffer and its colours, one sample a pixel. */
static void render_depth(const Scene *scene, const GLsizei index_count[2], int width, int height)
{
    glViewport(0, 0, width, height);
    aim(scene->clip_from_eye, 0, 0, width, height, width, height);
    draw(index_count);
    glFinish();
}

/* Draws two triangles in the way the scene will be drawn: only then Mesa compiles. */
static void compile_shaders(int width, int height)
{
    double position[9] = {-1, -1, 1, 1, -1, 1, 0, 1, 1};
    uint32_t corner[6] = {0, 1, 2, 0, 1, 2};
    float color[6] = {0};
    uint8_t flags[2] = {0, DOUBLE_SIDED};
    Scene scene = {3, 2, 0, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 1},
                   position, corner, color, flags};
    GLsizei index_count[2];
    upload(&scene, index_count);
    glViewport(0, 0, width, height);
    aim(scene.clip_from_eye, 0, 0, 1, 1, 1, 1);
    draw(index_count);
    glFinish();
}

int main(int arguments, char **argument)
{
    const char *picture = NULL;
    double begin, load, least = 1e30, spent = 0;
    GLsizei index_count[2];
    GLuint renderbuffers[2], framebuffer;
    Scene scene;
    Target t = {0};
    int target_width, target_height, rounds = 0;
    if (arguments < 5)
        fail("usage", "llvmpipe SCENE WIDTH HEIGHT N [--half] [--tile SAMPLES] [--no-color] [--picture OUT]");
    t.width = atoi(argument[2]);
    t.height = atoi(argument[3]);
    t.n = atoi(argument[4]);
    tile_side = 4096;
    for (int k = 5; k < arguments; k++) {
        if (!strcmp(argument[k], "--half"))
            half_float = 1;
        else if (!strcmp(argument[k], "--no-color"))
            no_color = 1;
        else if (!strcmp(argument[k], "--tile") && k + 1 < arguments)
            tile_side = atoi(argument[++k]);
        else if (!strcmp(argument[k], "--picture") && k + 1 < arguments)
            picture = argument[++k];
        else
            fail("unknown argument", argument[k]);
    }
    if (t.width < 1 || t.height < 1 || t.n < 0 || t.n > tile_side || tile_side > 16384)
        fail("size or N", "out of range");

    open_context();
    glUseProgram(link_program());
    if (t.n == 0) {
        target_width = t.width;
        target_height = t.height;
    } else {
        t.tile = tile_side / t.n;
        target_width = (t.width < t.tile ? t.width : t.tile) * t.n;
        target_height = (t.height < t.tile ? t.height : t.tile) * t.n;
        t.samples = malloc((size_t)target_width * target_height * (half_float ? 16 : 4));
        t.sums = malloc((size_t)t.tile * 16 + 16);
        t.rgb = malloc((size_t)t.width * t.height * 12);
        if (!t.samples || !t.sums || !t.rgb)
            fail("memory", "too little");
    }
    glGenFramebuffers(1, &framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glGenRenderbuffers(2, renderbuffers);
    if (!no_color) {
        glBindRenderbuffer(GL_RENDERBUFFER, renderbuffers[0]);
        glRenderbufferStorage(GL_RENDERBUFFER, half_float ? GL_RGBA16F : GL_RGBA8, target_width,
                              target_height);
        glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER,
                                  renderbuffers[0]);
    }
    glBindRenderbuffer(GL_RENDERBUFFER, renderbuffers[1]);
    glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT32F, target_width, target_height);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, renderbuffers[1]);
    if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
        fail("OpenGL", "the framebuffer is not complete");
    glEnable(GL_DEPTH_TEST);
    /* Nearer is greater. Of two equal ones the first stays, as in the scene's key order. */
    glDepthFunc(GL_GREATER);
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    /* Row 0 of the target is the top of the picture, which turns the winding round. */
    glFrontFace(GL_CW);
    glProvokingVertex(GL_FIRST_VERTEX_CONVENTION);
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    check_gl("setting up");

    compile_shaders(target_width, target_height);
    check_gl("compiling");

    begin = cpu_seconds();
    scene = read_scene(argument[1]);
    upload(&scene, index_count);
    free_scene(&scene);
    glFinish();
    load = cpu_seconds() - begin;

    do {
        double seconds;
        begin = cpu_seconds();
        if (t.n == 0)
            render_depth(&scene, index_count, t.width, t.height);
        else
            render(&scene, index_count, &t);
        seconds = cpu_seconds() - begin;
        spent += seconds;
        if (seconds < least)
            least = seconds;
    } while (++rounds < MOST_REPEATS && spent < PATIENCE_SECONDS);
    check_gl("drawing");
    if (picture && t.n > 0)
        write_picture(picture, t.rgb, t.width, t.height);
    printf("{\"samples\": %d, \"load\": %.6f, \"render\": %.6f}\n", t.n ? t.n * t.n : 1, load, least);
    return 0;
}
