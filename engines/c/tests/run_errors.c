/* What aonetRun refuses, and how it says so. */
#include "common.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>

#define REFUSED(text) CHECK_ERROR(aonetRun(session, &frame), AONET_ERROR_INVALID_ARGUMENT, text)

static GBuffer scene;
static float *visibility;
static AonetSession session;
static AonetFrame frame;

static void arguments(void) {
    CHECK_ERROR(aonetRun(NULL, &frame), AONET_ERROR_INVALID_ARGUMENT, "session: expected one that aonetNewSession");
    CHECK_ERROR(aonetRun(session, NULL), AONET_ERROR_INVALID_ARGUMENT, "AonetFrame");
    const size_t wrong_sizes[] = {0, sizeof frame - 8, sizeof frame + 8, SIZE_MAX};
    for (size_t i = 0; i < sizeof wrong_sizes / sizeof *wrong_sizes; i++) {
        frame = frame_of(&scene, visibility), frame.struct_size = wrong_sizes[i];
        REFUSED("struct_size of AonetFrame: expected");
    }
}

static void numbers(void) {
    const float bad_radii[] = {0.0f, -1.0f, INFINITY, NAN}, bad_angles[] = {-1.0f, 3.2f, 60.0f, INFINITY, NAN};
    for (size_t i = 0; i < sizeof bad_radii / sizeof *bad_radii; i++) {
        frame = frame_of(&scene, visibility), frame.radius = bad_radii[i];
        REFUSED("radius: expected a finite length > 0");
    }
    for (size_t i = 0; i < sizeof bad_angles / sizeof *bad_angles; i++) {
        frame = frame_of(&scene, visibility), frame.fov_y = bad_angles[i];
        REFUSED("camera fov_y (rad)");
    }
    frame = frame_of(&scene, visibility), frame.fov_y = 0.0f;
    REFUSED("camera: expected one of fov_y and clip_from_view, found none");
}

static void matrices(void) {
    float good[16] = {1.5f, 0, 0, 0, 0, 2.0f, 0, 0, 0, 0, 0, -1.0f, 0, 0, 0.1f, 0}, bad[16];
    float turn[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    frame = frame_of(&scene, visibility), frame.clip_from_view = good;
    REFUSED("found both");
    frame.fov_y = 0.0f;
    CHECK(aonetRun(session, &frame) == AONET_OK);
    frame.clip_from_view = (const float *)(const void *)((const char *)good + 2);
    REFUSED("clip_from_view: expected a pointer to 16 floats");
    const struct { int at; float value; } changes[] = {{0, 0}, {0, NAN}, {5, INFINITY}, {8, NAN}, {11, 1}, {11, 0}, {1, 0.5f}, {15, 1}};
    for (size_t i = 0; i < sizeof changes / sizeof *changes; i++) {
        for (int k = 0; k < 16; k++) bad[k] = good[k];
        bad[changes[i].at] = changes[i].value;
        frame.clip_from_view = bad;
        REFUSED("camera");
    }
    frame = frame_of(&scene, visibility), frame.view_from_world = turn;
    CHECK(aonetRun(session, &frame) == AONET_OK);
    const struct { int at; float value; } turns[] = {{0, 2}, {0, -1}, {5, NAN}, {12, INFINITY}, {3, 1}, {15, 0}};
    for (size_t i = 0; i < sizeof turns / sizeof *turns; i++) {
        for (int k = 0; k < 16; k++) bad[k] = turn[k];
        bad[turns[i].at] = turns[i].value;
        frame.view_from_world = bad;
        REFUSED("camera view_from_world");
    }
}

static void images(void) {
    frame = frame_of(&scene, visibility), frame.depth.data = NULL;
    REFUSED("data of depth: expected a pointer to floats, aligned to 4 bytes, found NULL");
    frame = frame_of(&scene, visibility), frame.normal.data = NULL;
    REFUSED("data of normal");
    frame = frame_of(&scene, NULL);
    REFUSED("data of visibility");
    frame = frame_of(&scene, visibility);
    frame.depth.data = (const float *)(const void *)((const char *)scene.depth + 1);
    REFUSED("not aligned");
    const ptrdiff_t pixel_strides[] = {1, 2, -4, 8, 13, PTRDIFF_MAX, PTRDIFF_MAX - 3, PTRDIFF_MIN};
    for (size_t i = 0; i < sizeof pixel_strides / sizeof *pixel_strides; i++) {
        frame = frame_of(&scene, visibility), frame.normal.pixel_stride = pixel_strides[i];
        REFUSED("pixel_stride of normal");
    }
    const ptrdiff_t row = (ptrdiff_t)(sizeof(float) * scene.width);
    const ptrdiff_t row_strides[] = {4, row - 4, -row + 4, row + 2, PTRDIFF_MAX - 3, PTRDIFF_MIN, PTRDIFF_MIN + 4};
    for (size_t i = 0; i < sizeof row_strides / sizeof *row_strides; i++) {
        frame = frame_of(&scene, visibility), frame.depth.row_stride = row_strides[i];
        REFUSED("row_stride of depth");
        frame = frame_of(&scene, visibility), frame.visibility.row_stride = row_strides[i];
        REFUSED("row_stride of visibility");
    }
}

/* Pixels out of range are named. */
static void pixels(void) {
    const size_t i = 7 * scene.width + 5;
    float *depth = need(malloc(picture_pixels(&scene) * sizeof(float)));
    const float bad_depths[] = {NAN, 0.0f, -1.0f, -INFINITY};
    const float kept_depth = scene.depth[i], kept_normal = scene.normal[3 * i];
    scene.depth[i] = 2.0f;
    for (size_t k = 0; k < sizeof bad_depths / sizeof *bad_depths; k++) {
        scene.depth[i] = bad_depths[k];
        frame = frame_of(&scene, visibility);
        REFUSED("depth at (5, 7): expected a distance > 0 or infinity");
    }
    scene.depth[i] = 2.0f;
    const float bad_normals[] = {NAN, INFINITY, 2.0f};
    for (size_t k = 0; k < sizeof bad_normals / sizeof *bad_normals; k++) {
        scene.normal[3 * i] = bad_normals[k];
        frame = frame_of(&scene, visibility);
        REFUSED("normal at (5, 7): expected a unit vector");
    }
    scene.depth[i] = kept_depth, scene.normal[3 * i] = kept_normal;

    const float bad_seconds[] = {NAN, 0.5f, -INFINITY};
    for (size_t k = 0; k < sizeof bad_seconds / sizeof *bad_seconds; k++) {
        for (size_t p = 0; p < picture_pixels(&scene); p++) depth[p] = scene.second[p];
        depth[i] = bad_seconds[k];
        frame = frame_of(&scene, visibility), frame.second_depth.data = depth;
        REFUSED("second depth at (5, 7)");
    }
    free(depth);

    for (size_t k = 0; k < 3 * picture_pixels(&scene); k++) scene.normal[k] = -scene.normal[k];
    frame = frame_of(&scene, visibility);
    REFUSED("face away");
    for (size_t k = 0; k < 3 * picture_pixels(&scene); k++) scene.normal[k] = -scene.normal[k];
}

int main(void) {
    scene = scene_render(64, 48, 0, 0);
    visibility = need(calloc(picture_pixels(&scene), sizeof(float)));
    AonetSessionOptions options = options_of(&scene, NULL);
    session = open_session(&options);
    arguments();
    numbers();
    matrices();
    images();
    for (size_t i = 0; i < picture_pixels(&scene); i++) visibility[i] = -7.0f;
    pixels();
    int is_untouched = 1;
    for (size_t i = 0; i < picture_pixels(&scene); i++) is_untouched &= visibility[i] == -7.0f;
    CHECK(is_untouched);

    /* After all that the session still works. */
    float *expected = visibility_of(&scene, NULL);
    frame = frame_of(&scene, visibility);
    CHECK(aonetRun(session, &frame) == AONET_OK);
    CHECK(same(visibility, expected, picture_pixels(&scene)));
    free(expected);
    aonetReleaseSession(session);
    free(visibility);
    gbuffer_free(&scene);
    return finish();
}
