#include "common.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int checks, failures;

void check(int good, const char *condition, const char *file, int line) {
    checks++;
    if (good) return;
    failures++;
    fprintf(stderr, "%s:%d: does not hold: %s\n", file, line, condition);
}

void check_error(int failed, AonetError code, const char *text, const char *call, const char *file, int line) {
    const char *message = NULL;
    AonetError found = aonetGetError(&message);
    checks++;
    if (failed && found == code && strstr(message, text)) return;
    failures++;
    fprintf(stderr, "%s:%d: %s: expected error %d with '%s', found %s, %d with '%s'\n", file, line, call, (int)code,
            text, failed ? "failure" : "success", (int)found, message);
}

int finish(void) {
    printf("%d checks, %d failures\n", checks, failures);
    return failures != 0 || checks == 0;
}

AonetSessionOptions options_of(const GBuffer *g, const char *method) {
    AonetSessionOptions options = {0};
    options.struct_size = sizeof options;
    options.width = g->width;
    options.height = g->height;
    options.margin_x = g->margin_x;
    options.margin_y = g->margin_y;
    options.method = method;
    options.threads = 1;
    return options;
}

AonetFrame frame_of(const GBuffer *g, float *visibility) {
    AonetFrame frame = {0};
    frame.struct_size = sizeof frame;
    frame.depth.data = g->depth;
    frame.normal.data = g->normal;
    frame.visibility.data = visibility;
    frame.fov_y = g->fov_y;
    frame.radius = 0.8f;
    return frame;
}

AonetSession open_session(const AonetSessionOptions *options) {
    AonetSession session = aonetNewSession(options);
    if (session) return session;
    const char *message;
    aonetGetError(&message);
    fprintf(stderr, "no session: %s\n", message);
    exit(2);
}

float *visibility_of(const GBuffer *g, const char *method) {
    float *visibility = need(calloc(picture_pixels(g), sizeof(float)));
    AonetSessionOptions options = options_of(g, method);
    AonetSession session = open_session(&options);
    AonetFrame frame = frame_of(g, visibility);
    CHECK(aonetRun(session, &frame) == AONET_OK);
    aonetReleaseSession(session);
    return visibility;
}

size_t picture_pixels(const GBuffer *g) { return g->width * g->height; }

int same(const float *a, const float *b, size_t count) { return memcmp(a, b, count * sizeof *a) == 0; }
