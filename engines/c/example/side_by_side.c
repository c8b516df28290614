/* Writes a picture of a scene lit without ambient occlusion, with gtao:tuned and with aonet, side by side.
 *
 *     side_by_side OUT.ppm                                            a scene of its own
 *     side_by_side OUT.ppm DEPTH.pfm NORMAL.pfm FOV_Y_DEGREES RADIUS  a frame of yours, in grey */
#define _POSIX_C_SOURCE 200809L /* clock_gettime */

#include <aonet.h>

#include "pfm.h"
#include "scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { PANELS = 3, GAP = 4 };

static const char *const METHODS[PANELS] = {NULL, "gtao:tuned", "balanced"};

/* What is drawn: images as aonet reads them, and the colours of surfaces (NULL: grey). */
typedef struct View {
    size_t width, height;
    AonetFrame frame;
    const float *colour;
    float *owned[4];
} View;

static double seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void fail(void) {
    const char *message;
    AonetError code = aonetGetError(&message);
    fprintf(stderr, "aonet error %d: %s\n", (int)code, message);
    exit(1);
}

static void compute(const View *view, const char *method, float *visibility) {
    AonetSessionOptions options = {0};
    options.struct_size = sizeof options;
    options.width = view->width;
    options.height = view->height;
    options.method = method;
    AonetSession session = aonetNewSession(&options);
    if (!session) fail();
    AonetFrame frame = view->frame;
    frame.visibility.data = visibility;
    double best = INFINITY;
    for (int run = 0; run < 5; run++) {
        double begin = seconds();
        if (aonetRun(session, &frame) != AONET_OK) fail();
        best = fmin(best, seconds() - begin);
    }
    printf("%-12s %6.1f ms\n", method, 1e3 * best);
    aonetReleaseSession(session);
}

/* The pixel of an image with strides that aonet read. */
static const float *at(const AonetInputImage *image, size_t width, size_t channels, size_t x, size_t y) {
    ptrdiff_t pixel = (ptrdiff_t)(channels * sizeof(float));
    ptrdiff_t row = image->row_stride ? image->row_stride : pixel * (ptrdiff_t)width;
    return (const float *)((const char *)image->data + (ptrdiff_t)y * row + (ptrdiff_t)x * pixel);
}

/* A panel of bytes, 3 a pixel: ambient light that visibility dims, and a little light from the upper left. */
static void shade(const View *view, const float *visibility, unsigned char *panel, size_t row_bytes) {
    for (size_t y = 0; y < view->height; y++) {
        for (size_t x = 0; x < view->width; x++) {
            size_t i = y * view->width + x;
            const float *n = at(&view->frame.normal, view->width, 3, x, y);
            int is_sky = isinf(*at(&view->frame.depth, view->width, 1, x, y));
            float direct = fmaxf(0.0f, -0.5f * n[0] + 0.7f * n[1] + 0.5f * n[2]);
            float light = is_sky ? 1.0f : 0.75f * visibility[i] + 0.25f * direct;
            for (size_t c = 0; c < 3; c++) {
                float colour = view->colour ? view->colour[3 * i + c] : 0.75f;
                float shown = powf(fminf(1.0f, light * powf(colour, 2.2f)), 1.0f / 2.2f);
                panel[y * row_bytes + 3 * x + c] = (unsigned char)(255.0f * shown + 0.5f);
            }
        }
    }
}

/* A view of rows from the bottom up: data points to the upper one, which is the last of the file. */
static AonetInputImage of_pfm(const Pfm *image) {
    size_t row = image->channels * image->width;
    AonetInputImage input = {image->data + (image->height - 1) * row, 0, -(ptrdiff_t)(row * sizeof(float))};
    return input;
}

static View read_view(char **arguments) {
    Pfm depth = pfm_read(arguments[0], 1), normal = pfm_read(arguments[1], 3);
    if (depth.width != normal.width || depth.height != normal.height) {
        fputs("depth and normals have different sizes\n", stderr);
        exit(2);
    }
    View view = {depth.width, depth.height, {0}, NULL, {depth.data, normal.data, NULL, NULL}};
    view.frame.fov_y = strtof(arguments[2], NULL) * 3.14159265f / 180.0f;
    view.frame.radius = strtof(arguments[3], NULL);
    view.frame.depth = of_pfm(&depth);
    view.frame.normal = of_pfm(&normal);
    return view;
}

static View own_view(void) {
    GBuffer g = scene_render(640, 480, 0, 0);
    View view = {g.width, g.height, {0}, g.colour, {g.depth, g.normal, g.second, g.colour}};
    view.frame.fov_y = g.fov_y;
    view.frame.radius = 0.8f;
    view.frame.depth.data = g.depth;
    view.frame.normal.data = g.normal;
    return view;
}

int main(int count, char **arguments) {
    if (count != 2 && count != 6) {
        fprintf(stderr, "usage: %s OUT.ppm [DEPTH.pfm NORMAL.pfm FOV_Y_DEGREES RADIUS]\n", arguments[0]);
        return 2;
    }
    View view = count == 6 ? read_view(arguments + 2) : own_view();
    view.frame.struct_size = sizeof view.frame;
    size_t width = PANELS * view.width + (PANELS - 1) * GAP, row_bytes = 3 * width, pixels = view.width * view.height;
    unsigned char *picture = need(calloc(view.height, row_bytes));
    float *visibility = need(malloc(pixels * sizeof *visibility));
    for (size_t panel = 0; panel < PANELS; panel++) {
        for (size_t i = 0; i < pixels; i++) visibility[i] = 1.0f;
        if (METHODS[panel]) compute(&view, METHODS[panel], visibility);
        shade(&view, visibility, picture + 3 * panel * (view.width + GAP), row_bytes);
    }
    FILE *file = fopen(arguments[1], "wb");
    int good = file && fprintf(file, "P6\n%u %u\n255\n", (unsigned)width, (unsigned)view.height) > 0;
    good = good && fwrite(picture, row_bytes, view.height, file) == view.height;
    if (!file || fclose(file) != 0 || !good) {
        fprintf(stderr, "%s: cannot be written\n", arguments[1]);
        return 1;
    }
    for (size_t i = 0; i < sizeof view.owned / sizeof *view.owned; i++) free(view.owned[i]);
    free(picture);
    free(visibility);
    return 0;
}
