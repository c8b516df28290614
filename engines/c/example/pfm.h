/* Portable float maps, as they lie in a file: little-endian floats, rows from the bottom up. */
#ifndef PFM_H
#define PFM_H

#include <stddef.h>

typedef struct Pfm {
    size_t width, height, channels;
    float *data; /* first row of the file: the lowest one */
} Pfm;

/* Reads a file of so many channels (1 or 3), or ends the program. Free data. */
Pfm pfm_read(const char *path, size_t channels);

#endif
