// Embree 3: jittered samples, one for each cell of n x n in a pixel, traced in packets of 16.
//
//   embree SCENE WIDTH HEIGHT N [--picture OUT.npy]
//
// One thread. Prints CPU seconds as JSON: "load" is reading the file and building the hierarchy,
// "render" the least of several rounds of making rays, tracing and averaging. Faces turned away that
// must not be seen are left out of the hierarchy: the eye stands still, so that spares a filter.
#include "scene.h"
#include <cmath>
#include <embree3/rtcore.h>
#include <vector>
#if defined(__SSE3__)
#include <pmmintrin.h>
#endif

struct View {
    // Eye space (at depth 1 in perspective) from a picture that runs from -1 to 1 in x and y.
    double scale_x, scale_y;
    bool perspective;
};

static View view_of(const Scene &scene)
{
    View view{};
    view.perspective = scene.perspective != 0;
    view.scale_x = 1.0 / scene.clip_from_eye[0];
    view.scale_y = 1.0 / scene.clip_from_eye[5];
    return view;
}

static bool seen_from_eye(const Scene &scene, uint32_t triangle)
{
    if (scene.flags[triangle] & DOUBLE_SIDED)
        return true;
    const uint32_t *corner = scene.corner + 3 * (size_t)triangle;
    const double *p = scene.position + 3 * (size_t)corner[0];
    const double *q = scene.position + 3 * (size_t)corner[1];
    const double *r = scene.position + 3 * (size_t)corner[2];
    double u[3], v[3];
    for (int k = 0; k < 3; k++) {
        u[k] = q[k] - p[k];
        v[k] = r[k] - p[k];
    }
    double normal[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
    return scene.perspective ? normal[0] * p[0] + normal[1] * p[1] + normal[2] * p[2] < 0 : normal[2] < 0;
}

static RTCScene build(RTCDevice device, const Scene &scene, std::vector<uint32_t> &source)
{
    source.reserve(scene.triangles);
    for (uint32_t triangle = 0; triangle < scene.triangles; triangle++)
        if (seen_from_eye(scene, triangle))
            source.push_back(triangle);
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    float *vertices = (float *)rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                       RTC_FORMAT_FLOAT3, 12, scene.vertices);
    uint32_t *indices = (uint32_t *)rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0,
                                                            RTC_FORMAT_UINT3, 12, source.size());
    for (size_t k = 0; k < 3 * (size_t)scene.vertices; k++)
        vertices[k] = (float)scene.position[k];
    for (size_t k = 0; k < source.size(); k++)
        memcpy(indices + 3 * k, scene.corner + 3 * (size_t)source[k], 12);
    rtcCommitGeometry(geometry);
    RTCScene built = rtcNewScene(device);
    rtcAttachGeometry(built, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(built);
    return built;
}

// Marsaglia's xorshift: what matters is that it costs little.
struct Random {
    uint32_t state = 0x9e3779b9u;
    float unit()
    {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        return (float)(state >> 8) * (1.0f / 16777216.0f);
    }
};

static const int PACKET = 16;
// Pixels are visited in blocks of this side, so that the rays of a packet stay close together.
static const int BLOCK = 4;

struct Tracer {
    RTCScene scene;
    const View &view;
    const float *colors; // of the hierarchy's triangles
    float *rgb;
    float weight;
    int filled = 0;
    uint32_t pixel[PACKET];
    alignas(64) RTCRayHit16 packet;
    RTCIntersectContext context;

    Tracer(RTCScene scene, const View &view, const float *colors, float *rgb, float weight)
        : scene(scene), view(view), colors(colors), rgb(rgb), weight(weight)
    {
        rtcInitIntersectContext(&context);
        context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    }

    // x and y from -1 to 1 across the picture.
    void push(uint32_t at, float x, float y)
    {
        float across = x * (float)view.scale_x, down = y * (float)view.scale_y;
        RTCRay16 &ray = packet.ray;
        int k = filled++;
        pixel[k] = at;
        ray.org_x[k] = view.perspective ? 0.0f : across;
        ray.org_y[k] = view.perspective ? 0.0f : down;
        ray.org_z[k] = 0.0f;
        ray.dir_x[k] = view.perspective ? across : 0.0f;
        ray.dir_y[k] = view.perspective ? down : 0.0f;
        ray.dir_z[k] = 1.0f;
        ray.tnear[k] = 0.0f;
        ray.tfar[k] = INFINITY;
        ray.time[k] = 0.0f;
        ray.mask[k] = ~0u;
        ray.id[k] = (unsigned)k;
        ray.flags[k] = 0;
        packet.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
        if (filled == PACKET)
            trace();
    }

    void trace()
    {
        alignas(64) int valid[PACKET];
        for (int k = 0; k < PACKET; k++)
            valid[k] = k < filled ? -1 : 0;
        rtcIntersect16(valid, scene, &context, &packet);
        for (int k = 0; k < filled; k++) {
            if (packet.hit.geomID[k] == RTC_INVALID_GEOMETRY_ID)
                continue;
            const float *color = colors + 3 * (size_t)packet.hit.primID[k];
            float *out = rgb + 3 * (size_t)pixel[k];
            for (int channel = 0; channel < 3; channel++)
                out[channel] += weight * color[channel];
        }
        filled = 0;
    }
};

static void render(RTCScene scene, const View &view, const float *colors, int width, int height, int n,
                   float *rgb)
{
    memset(rgb, 0, (size_t)width * height * 12);
    Random random;
    Tracer tracer(scene, view, colors, rgb, 1.0f / ((float)n * (float)n));
    float cell_x = 2.0f / ((float)width * n), cell_y = 2.0f / ((float)height * n);
    for (int block_y = 0; block_y < height; block_y += BLOCK)
        for (int block_x = 0; block_x < width; block_x += BLOCK)
            for (int y = block_y; y < block_y + BLOCK && y < height; y++)
                for (int x = block_x; x < block_x + BLOCK && x < width; x++)
                    for (int j = 0; j < n; j++)
                        for (int i = 0; i < n; i++) {
                            float at_x = (float)(x * n + i) + random.unit();
                            float at_y = (float)(y * n + j) + random.unit();
                            tracer.push((uint32_t)(y * width + x), at_x * cell_x - 1.0f,
                                        at_y * cell_y - 1.0f);
                        }
    if (tracer.filled)
        tracer.trace();
}

int main(int arguments, char **argument)
{
    if (arguments != 5 && !(arguments == 7 && !strcmp(argument[5], "--picture")))
        fail("usage", "embree SCENE WIDTH HEIGHT N [--picture OUT.npy]");
    int width = atoi(argument[2]), height = atoi(argument[3]), n = atoi(argument[4]);
    if (width < 1 || height < 1 || n < 1)
        fail("size or N", "out of range");

#if defined(__SSE3__)
    // As Embree's manual asks.
    _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
    _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
#endif

    double begin = cpu_seconds();
    Scene scene = read_scene(argument[1]);
    RTCDevice device = rtcNewDevice("threads=1,set_affinity=0");
    if (!device)
        fail("Embree", "no device");
    std::vector<uint32_t> source;
    RTCScene built = build(device, scene, source);
    std::vector<float> colors(3 * source.size() + 1);
    for (size_t k = 0; k < source.size(); k++)
        memcpy(&colors[3 * k], scene.color + 3 * (size_t)source[k], 12);
    View view = view_of(scene);
    free_scene(&scene);
    double load = cpu_seconds() - begin;

    std::vector<float> rgb((size_t)width * height * 3);
    double least = INFINITY, spent = 0;
    for (int rounds = 0; rounds < MOST_REPEATS && spent < PATIENCE_SECONDS; rounds++) {
        begin = cpu_seconds();
        render(built, view, colors.data(), width, height, n, rgb.data());
        double seconds = cpu_seconds() - begin;
        spent += seconds;
        least = std::fmin(least, seconds);
    }
    if (rtcGetDeviceError(device) != RTC_ERROR_NONE)
        fail("Embree", "an error");
    if (arguments == 7)
        write_picture(argument[6], rgb.data(), width, height);
    printf("{\"samples\": %d, \"load\": %.6f, \"render\": %.6f}\n", n * n, load, least);
    rtcReleaseScene(built);
    rtcReleaseDevice(device);
    return 0;
}
