/* Images with gaps, side by side in one pixel, from the bottom up, and in world space give the tight image's result. */
#include "common.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTH = 97, HEIGHT = 61, X = 6, Y = 5, COLUMNS = WIDTH + 2 * X, ROWS = HEIGHT + 2 * Y };

static GBuffer scene;
static float *expected, *visibility;
static AonetSession session;

static AonetFrame whole_frame(void) {
    AonetFrame frame = frame_of(&scene, visibility);
    frame.second_depth.data = scene.second;
    return frame;
}

static void check_run(const AonetFrame *frame) {
    memset(visibility, 0, picture_pixels(&scene) * sizeof(float));
    CHECK(aonetRun(session, frame) == AONET_OK);
    CHECK(same(visibility, expected, picture_pixels(&scene)));
}

/* All of a pixel in one struct, with rows that are longer than the picture. */
typedef struct Pixel {
    char before[4];
    float depth, normal[3], second, visibility;
    char behind[8];
} Pixel;

static void interleaved(void) {
    const size_t row = COLUMNS + 3;
    Pixel *pixels = need(malloc(row * ROWS * sizeof *pixels));
    memset(pixels, 0xff, row * ROWS * sizeof *pixels);
    for (size_t i = 0; i < gbuffer_pixels(&scene); i++) {
        Pixel *pixel = &pixels[i / COLUMNS * row + i % COLUMNS];
        pixel->depth = scene.depth[i], pixel->second = scene.second[i];
        memcpy(pixel->normal, &scene.normal[3 * i], sizeof pixel->normal);
    }
    Pixel *before = need(malloc(row * ROWS * sizeof *pixels));
    memcpy(before, pixels, row * ROWS * sizeof *pixels);
    const ptrdiff_t strides[2] = {(ptrdiff_t)sizeof(Pixel), (ptrdiff_t)(row * sizeof(Pixel))};
    AonetFrame frame = whole_frame();
    frame.depth = (AonetInputImage){&pixels->depth, strides[0], strides[1]};
    frame.normal = (AonetInputImage){pixels->normal, strides[0], strides[1]};
    frame.second_depth = (AonetInputImage){&pixels->second, strides[0], strides[1]};
    frame.visibility = (AonetOutputImage){&pixels[Y * row + X].visibility, strides[0], strides[1]};
    CHECK(aonetRun(session, &frame) == AONET_OK);
    int is_equal = 1;
    for (size_t i = 0; i < picture_pixels(&scene); i++) {
        const size_t at = (i / WIDTH + Y) * row + i % WIDTH + X;
        is_equal &= same(&pixels[at].visibility, &expected[i], 1);
        pixels[at].visibility = before[at].visibility;
    }
    CHECK(is_equal);
    /* Nothing else was written. */
    CHECK(memcmp(pixels, before, row * ROWS * sizeof *pixels) == 0);
    free(before);
    free(pixels);
}

static void bottom_up(void) {
    float *depth = need(malloc(gbuffer_pixels(&scene) * sizeof(float)));
    float *normal = need(malloc(3 * gbuffer_pixels(&scene) * sizeof(float)));
    float *result = need(malloc(picture_pixels(&scene) * sizeof(float)));
    for (size_t y = 0; y < ROWS; y++) {
        memcpy(&depth[(ROWS - 1 - y) * COLUMNS], &scene.depth[y * COLUMNS], COLUMNS * sizeof(float));
        memcpy(&normal[(ROWS - 1 - y) * 3 * COLUMNS], &scene.normal[y * 3 * COLUMNS], 3 * COLUMNS * sizeof(float));
    }
    const ptrdiff_t row = COLUMNS * (ptrdiff_t)sizeof(float);
    AonetFrame frame = whole_frame();
    frame.depth = (AonetInputImage){&depth[(ROWS - 1) * COLUMNS], 0, -row};
    frame.normal = (AonetInputImage){&normal[(ROWS - 1) * 3 * COLUMNS], 12, -3 * row};
    check_run(&frame);
    frame.visibility = (AonetOutputImage){&result[(HEIGHT - 1) * WIDTH], 4, -WIDTH * (ptrdiff_t)sizeof(float)};
    CHECK(aonetRun(session, &frame) == AONET_OK);
    for (size_t y = 0; y < HEIGHT; y++) CHECK(same(&result[(HEIGHT - 1 - y) * WIDTH], &expected[y * WIDTH], WIDTH));
    free(depth);
    free(normal);
    free(result);
}

/* Strides that are written out; and visibility over depth. */
static void tight_and_in_place(void) {
    AonetFrame frame = whole_frame();
    frame.depth.pixel_stride = 4, frame.depth.row_stride = 4 * COLUMNS;
    frame.normal.row_stride = 12 * COLUMNS;
    check_run(&frame);
    float *depth = need(malloc(gbuffer_pixels(&scene) * sizeof(float)));
    memcpy(depth, scene.depth, gbuffer_pixels(&scene) * sizeof(float));
    frame.depth.data = depth;
    frame.visibility.data = depth;
    CHECK(aonetRun(session, &frame) == AONET_OK);
    CHECK(same(depth, expected, picture_pixels(&scene)));
    free(depth);
}

/* World space that is view space with other axes: view (x, y, z) is world (y, z, x), and elsewhere. */
static void world_space(void) {
    const float view_from_world[16] = {0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 3, -2, 5, 1};
    float *normal = need(malloc(3 * gbuffer_pixels(&scene) * sizeof(float)));
    for (size_t i = 0; i < 3 * gbuffer_pixels(&scene); i += 3) {
        normal[i] = scene.normal[i + 2], normal[i + 1] = scene.normal[i], normal[i + 2] = scene.normal[i + 1];
    }
    AonetFrame frame = whole_frame();
    frame.normal.data = normal;
    frame.view_from_world = view_from_world;
    check_run(&frame);
    free(normal);
}

/* Normals where there is nothing do not matter, and lengths may be a little off. */
static void untidy_normals(void) {
    float *normal = need(malloc(3 * gbuffer_pixels(&scene) * sizeof(float)));
    for (size_t i = 0; i < 3 * gbuffer_pixels(&scene); i++) {
        normal[i] = isinf(scene.depth[i / 3]) ? (i % 2 ? NAN : 5.0f) : scene.normal[i];
    }
    AonetFrame frame = whole_frame();
    frame.normal.data = normal;
    memset(visibility, 0, picture_pixels(&scene) * sizeof(float));
    CHECK(aonetRun(session, &frame) == AONET_OK);
    float most = 0.0f;
    for (size_t i = 0; i < picture_pixels(&scene); i++) most = fmaxf(most, fabsf(visibility[i] - expected[i]));
    /* Lengths were off by a rounding before. */
    CHECK(most < 1e-4f);
    for (size_t i = 0; i < 3 * gbuffer_pixels(&scene); i++) normal[i] = 1.03f * scene.normal[i];
    CHECK(aonetRun(session, &frame) == AONET_OK);
    for (size_t i = 0; i < picture_pixels(&scene); i++) most = fmaxf(most, fabsf(visibility[i] - expected[i]));
    CHECK(most < 1e-4f);
    free(normal);
}

int main(void) {
    scene = scene_render(WIDTH, HEIGHT, X, Y);
    expected = need(calloc(picture_pixels(&scene), sizeof(float)));
    visibility = need(calloc(picture_pixels(&scene), sizeof(float)));
    AonetSessionOptions options = options_of(&scene, "arcs:deep");
    session = open_session(&options);
    AonetFrame frame = whole_frame();
    frame.visibility.data = expected;
    CHECK(aonetRun(session, &frame) == AONET_OK);
    interleaved();
    bottom_up();
    tight_and_in_place();
    world_space();
    untidy_normals();
    aonetReleaseSession(session);
    free(expected);
    free(visibility);
    gbuffer_free(&scene);
    return finish();
}
