/* Writes frames and what the library computed for them, for the example `truth`. Argument: a folder. */
#include "common.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What a frame has beside a scene. */
typedef struct Case {
    const char *method;
    size_t width, height, margin_x, margin_y;
    AonetPrecision precision;
    const float *clip_from_view;
    int has_second, is_world, is_untidy;
} Case;

static const float OFF_CENTRE[16] = {1.9f, 0, 0, 0, 0, 2.6f, 0, 0, 0.07f, -0.11f, 0, -1.0f, 0, 0, 0.1f, 0};
/* Clip space with y down, as in Vulkan. */
static const float FLIPPED[16] = {1.9f, 0, 0, 0, 0, -2.6f, 0, 0, 0, 0, 0, -1.0f, 0, 0, 0.1f, 0};
static const float PARALLEL[16] = {0.3f, 0, 0, 0, 0, 0.4f, 0, 0, 0, 0, -0.01f, 0, 0, 0, 0, 1.0f};
/* Turns axes, so that no number is rounded: view (x, y, z) is world (y, z, x). */
static const float VIEW_FROM_WORLD[16] = {0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 1, 2, 3, 1};

static const Case CASES[] = {
    {"balanced", 160, 120, 0, 0, AONET_PRECISION_F32, NULL, 0, 0, 0},
    {"balanced", 97, 61, 7, 3, AONET_PRECISION_FASTEST, OFF_CENTRE, 0, 0, 1},
    {"balanced", 64, 64, 0, 0, AONET_PRECISION_F32, PARALLEL, 0, 1, 0},
    {"high", 120, 90, 18, 14, AONET_PRECISION_F32, NULL, 1, 0, 0},
    {"high", 81, 50, 0, 0, AONET_PRECISION_FASTEST, FLIPPED, 1, 1, 1},
    {"paper", 64, 48, 0, 0, AONET_PRECISION_F32, NULL, 0, 0, 0},
    {"gtao:tuned", 160, 120, 0, 0, AONET_PRECISION_F32, NULL, 0, 0, 0},
    {"arcs:deep", 100, 75, 15, 11, AONET_PRECISION_F32, OFF_CENTRE, 1, 1, 0},
    {"ssao", 50, 40, 5, 0, AONET_PRECISION_F32, NULL, 0, 0, 1},
    {"nnao", 1, 1, 2, 3, AONET_PRECISION_F32, NULL, 0, 0, 0},
};

static FILE *file;

static void put(const void *bytes, size_t count) {
    if (fwrite(bytes, 1, count, file) != count) exit(2);
}

static void put_whole(size_t number) {
    unsigned char bytes[4] = {(unsigned char)number, (unsigned char)(number >> 8), 0, 0};
    put(bytes, 4);
}

/* Normals that are not 0 where there is nothing, and not quite of unit length. */
static void make_untidy(const GBuffer *g) {
    for (size_t i = 0; i < 3 * gbuffer_pixels(g); i++) {
        g->normal[i] = isinf(g->depth[i / 3]) ? 0.5f : g->normal[i] * (1.0f + 0.01f * sinf((float)(i / 3)));
    }
}

static void put_case(const Case *c) {
    GBuffer g = scene_render(c->width, c->height, c->margin_x, c->margin_y);
    if (c->is_untidy) make_untidy(&g);
    const size_t pixels = gbuffer_pixels(&g);
    float *visibility = need(calloc(picture_pixels(&g), sizeof(float)));
    float *world = need(malloc(3 * pixels * sizeof(float)));
    for (size_t i = 0; i < 3 * pixels; i += 3) {
        world[i] = g.normal[i + 2], world[i + 1] = g.normal[i], world[i + 2] = g.normal[i + 1];
    }
    AonetSessionOptions options = options_of(&g, c->method);
    options.precision = c->precision;
    options.threads = 2;
    AonetSession session = open_session(&options);
    AonetFrame frame = frame_of(&g, visibility);
    frame.clip_from_view = c->clip_from_view;
    if (c->clip_from_view) frame.fov_y = 0.0f;
    if (c->is_world) frame.normal.data = world, frame.view_from_world = VIEW_FROM_WORLD;
    if (c->has_second) frame.second_depth.data = g.second;
    CHECK(aonetRun(session, &frame) == AONET_OK);
    aonetReleaseSession(session);

    char name[32] = "";
    strncpy(name, c->method, sizeof name - 1);
    put(name, sizeof name);
    put_whole(c->width), put_whole(c->height), put_whole(c->margin_x), put_whole(c->margin_y);
    put_whole(c->precision), put_whole(c->clip_from_view != NULL), put_whole((size_t)c->has_second);
    put(&frame.fov_y, sizeof(float)), put(&frame.radius, sizeof(float));
    static const float none[16] = {0};
    put(c->clip_from_view ? c->clip_from_view : none, sizeof none);
    put(g.depth, pixels * sizeof(float)), put(g.normal, 3 * pixels * sizeof(float));
    put(g.second, pixels * sizeof(float)), put(visibility, picture_pixels(&g) * sizeof(float));
    free(world);
    free(visibility);
    gbuffer_free(&g);
}

int main(int count, char **arguments) {
    if (count != 2) return 2;
    for (size_t i = 0; i < sizeof CASES / sizeof *CASES; i++) {
        char path[4096];
        snprintf(path, sizeof path, "%s/%u.frame", arguments[1], (unsigned)i);
        file = fopen(path, "wb");
        if (!file) return 2;
        put_case(&CASES[i]);
        if (fclose(file) != 0) return 2;
    }
    return finish();
}
