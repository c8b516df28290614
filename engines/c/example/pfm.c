#include "pfm.h"
#include "scene.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

Pfm pfm_read(const char *path, size_t channels) {
    FILE *file = fopen(path, "rb");
    char kind[3] = "";
    unsigned width = 0, height = 0;
    float order = 0.0f;
    int found = file ? fscanf(file, "%2s %u %u %f", kind, &width, &height, &order) : 0;
    int good = found == 4 && strcmp(kind, channels == 3 ? "PF" : "Pf") == 0 && order < 0.0f;
    if (!good || fgetc(file) == EOF || !width || !height || width > 32768 || height > 32768) {
        fprintf(stderr, "%s: expected a little-endian PFM file of %u channels\n", path, (unsigned)channels);
        exit(2);
    }
    Pfm image = {width, height, channels, NULL};
    size_t count = channels * width * height;
    image.data = need(malloc(count * sizeof(float)));
    if (fread(image.data, sizeof(float), count, file) != count) {
        fprintf(stderr, "%s: expected %u x %u pixels, found fewer\n", path, width, height);
        exit(2);
    }
    fclose(file);
    return image;
}
