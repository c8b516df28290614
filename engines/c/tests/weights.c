/* A network from a file and from bytes is the network of that name. Arguments: a weights file and its name. */
#include "common.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static unsigned char *read_all(const char *path, size_t *count) {
    FILE *file = fopen(path, "rb");
    if (!file || fseek(file, 0, SEEK_END) != 0) exit(2);
    *count = (size_t)ftell(file);
    rewind(file);
    unsigned char *bytes = need(malloc(*count));
    if (fread(bytes, 1, *count, file) != *count) exit(2);
    fclose(file);
    return bytes;
}

static void check_session(const GBuffer *g, AonetSession session, const float *expected) {
    float *visibility = need(calloc(picture_pixels(g), sizeof(float)));
    AonetFrame frame = frame_of(g, visibility);
    CHECK(aonetRun(session, &frame) == AONET_OK);
    CHECK(same(visibility, expected, picture_pixels(g)));
    aonetReleaseSession(session);
    free(visibility);
}

int main(int count, char **arguments) {
    if (count != 3) return 2;
    GBuffer scene = scene_render(80, 60, 0, 0);
    float *expected = visibility_of(&scene, arguments[2]);
    AonetSessionOptions options = options_of(&scene, NULL);
    options.weights_path = arguments[1];
    check_session(&scene, open_session(&options), expected);
    options.weights_path = NULL;
    unsigned char *bytes = read_all(arguments[1], &options.weights_size);
    options.weights = bytes;
    AonetSession session = open_session(&options);
    /* The session keeps nothing of them. */
    memset(bytes, 0, options.weights_size);
    free(bytes);
    check_session(&scene, session, expected);
    free(expected);
    gbuffer_free(&scene);
    return finish();
}
