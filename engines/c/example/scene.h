/* A small scene, seen by casting a ray for each pixel: what a renderer has when it calls aonet. */
#ifndef SCENE_H
#define SCENE_H

#include <stddef.h>

/* Images of (width + 2 margin_x) x (height + 2 margin_y) pixels, row by row from the top. */
typedef struct GBuffer {
    size_t width, height, margin_x, margin_y;
    float fov_y;   /* of the picture, radians */
    float *depth;  /* along the axis of the view; infinity where there is nothing */
    float *normal; /* 3 floats, view space, unit length; 0 where there is nothing */
    float *second; /* depth of what lies behind */
    float *colour; /* 3 floats */
} GBuffer;

/* Renders spheres and boxes on a floor, in front of an open sky. */
GBuffer scene_render(size_t width, size_t height, size_t margin_x, size_t margin_y);

void gbuffer_free(GBuffer *g);

/* Number of pixels of the images. */
size_t gbuffer_pixels(const GBuffer *g);

/* Memory that was found, or the end of the program. */
void *need(void *memory);

#endif
