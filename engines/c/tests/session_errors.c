/* What aonetNewSession refuses, and how it says so. Argument: a folder with a file of weights, balanced.safetensors. */
#include "common.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define REFUSED(text) REFUSED_AS(AONET_ERROR_INVALID_ARGUMENT, text)
#define REFUSED_AS(code, text) CHECK_ERROR(aonetNewSession(&options) == NULL, code, text)

static AonetSessionOptions fresh(void) {
    GBuffer size = {64, 48, 0, 0, 0.0f, NULL, NULL, NULL, NULL};
    return options_of(&size, NULL);
}

static void sizes(void) {
    AonetSessionOptions options = fresh();
    CHECK_ERROR(aonetNewSession(NULL) == NULL, AONET_ERROR_INVALID_ARGUMENT, "found NULL");
    const AonetSessionOptions *crooked = (const AonetSessionOptions *)(const void *)((const char *)&options + 1);
    CHECK_ERROR(aonetNewSession(crooked) == NULL, AONET_ERROR_INVALID_ARGUMENT, "not aligned");
    const size_t wrong_sizes[] = {0, 1, sizeof options - 4, sizeof options + 8, SIZE_MAX};
    for (size_t i = 0; i < sizeof wrong_sizes / sizeof *wrong_sizes; i++) {
        options = fresh(), options.struct_size = wrong_sizes[i];
        REFUSED("struct_size of AonetSessionOptions");
    }
    options = fresh(), options.width = 0;
    REFUSED("width and height: expected width and height in 1..=32768, found 0x48");
    options = fresh(), options.height = 32769;
    REFUSED("64x32769");
    options = fresh(), options.height = SIZE_MAX;
    REFUSED("width and height");
    options = fresh(), options.margin_x = 16353;
    REFUSED("margin: expected at most 32768");
    options = fresh(), options.margin_y = SIZE_MAX;
    REFUSED("margin");
    options = fresh(), options.threads = 1025;
    REFUSED("threads");
    options = fresh(), options.threads = SIZE_MAX;
    REFUSED("threads");
}

static void names(void) {
    AonetSessionOptions options = fresh();
    const char *const unknown[] = {"", "GTAO", "gtao:deep", "gtao:", ":tuned", "balanced:tuned", "\xff\xfe", "any radius"};
    for (size_t i = 0; i < sizeof unknown / sizeof *unknown; i++) {
        options = fresh(), options.method = unknown[i];
        REFUSED("method: expected one of fast, balanced, high, paper, ssao, ssao:tuned");
    }
    options = fresh(), options.precision = (AonetPrecision)7;
    REFUSED("precision: expected an AonetPrecision, 0 to 3, found 7");
    options = fresh(), options.method = "gtao", options.precision = AONET_PRECISION_INT8;
    CHECK(aonetNewSession(&options) == NULL);
    const AonetError code = aonetGetError(NULL);
    CHECK(code == AONET_ERROR_INVALID_ARGUMENT || code == AONET_ERROR_UNSUPPORTED_HARDWARE);
}

static void weights(const char *folder) {
    AonetSessionOptions options = fresh();
    options.weights_path = "no_such_file.safetensors";
    REFUSED_AS(AONET_ERROR_INVALID_WEIGHTS, "weights file no_such_file.safetensors: expected a file that can be read");
    options = fresh(), options.weights_path = folder;
    REFUSED_AS(AONET_ERROR_INVALID_WEIGHTS, "not a file");
    options = fresh(), options.weights_path = "";
    REFUSED_AS(AONET_ERROR_INVALID_WEIGHTS, "weights file");
    char path[4096];
    snprintf(path, sizeof path, "%s/nnao.safetensors", folder);
    options = fresh(), options.weights_path = path;
    REFUSED_AS(AONET_ERROR_INVALID_WEIGHTS, "expected a network");
    char garbage[200];
    memset(garbage, 'x', sizeof garbage);
    options = fresh(), options.weights = garbage, options.weights_size = sizeof garbage;
    REFUSED_AS(AONET_ERROR_INVALID_WEIGHTS, "");
    options.weights_size = 0;
    REFUSED_AS(AONET_ERROR_INVALID_WEIGHTS, "");
    options.weights_size = SIZE_MAX;
    REFUSED("weights_size");
    options = fresh(), options.weights_size = 5;
    REFUSED("weights: expected bytes");
    options = fresh(), options.method = "high", options.weights_path = path;
    REFUSED("at most one");
    options = fresh(), options.weights = garbage, options.weights_size = 9, options.weights_path = path;
    REFUSED("at most one");
}

/* A file that ends too early, at many places. */
static void short_weights(const char *folder) {
    char path[4096];
    snprintf(path, sizeof path, "%s/balanced.safetensors", folder);
    FILE *file = fopen(path, "rb");
    CHECK(file != NULL);
    if (!file) return;
    unsigned char *bytes = need(malloc(2000000));
    size_t count = fread(bytes, 1, 2000000, file);
    fclose(file);
    CHECK(count > 100000 && count < 2000000);
    AonetSessionOptions options = fresh();
    options.weights = bytes;
    for (size_t end = 0; end < count; end += count / 23) {
        options.weights_size = end;
        REFUSED_AS(AONET_ERROR_INVALID_WEIGHTS, "");
    }
    free(bytes);
}

static void last_error(void) {
    const char *message = NULL;
    CHECK(aonetGetError(&message) == AONET_OK && message && strcmp(message, "") == 0);
    CHECK(aonetNewSession(NULL) == NULL);
    CHECK(aonetGetError(NULL) == AONET_ERROR_INVALID_ARGUMENT);
    CHECK(aonetGetError(NULL) == AONET_OK);
    CHECK(aonetNewSession(NULL) == NULL);
    AonetSessionOptions options = fresh();
    /* A success is no reason to forget an error that nobody has asked for. */
    aonetReleaseSession(open_session(&options));
    CHECK(aonetGetError(&message) == AONET_ERROR_INVALID_ARGUMENT && strstr(message, "AonetSessionOptions"));
    aonetReleaseSession(NULL);
    CHECK(aonetGetError(NULL) == AONET_OK);
}

int main(int count, char **arguments) {
    if (count != 2) return 2;
    sizes();
    names();
    weights(arguments[1]);
    short_weights(arguments[1]);
    last_error();
    return finish();
}
