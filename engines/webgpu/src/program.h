/* Runs a program of `aonet export --program DIR --size WxH` on any implementation of webgpu.h.
 * docs/program_format.md describes the files: this is format 1, for frames of one size. */
#ifndef AONET_PROGRAM_H
#define AONET_PROGRAM_H

#include <stdint.h>
#include <webgpu.h>

/* The numbers of a frame, as shaders read them. */
typedef struct AonetFrame {
    float view_from_normals[3][4]; /* columns; the identity for normals in view space */
    uint32_t size[2];              /* of the textures (px) */
    float depth_line[2];           /* 1 and 0 for linear depth */
    float pixel_size[2];           /* 1 / focal length in px and 0; 0 and world units a pixel for parallel projections */
    float centre[2];               /* where the camera's axis meets the textures (px) */
    float aspect;                  /* width of a pixel over its height */
    float radius;                  /* world units */
    float log2_radius_px;          /* log2(radius * focal length in px) */
    uint32_t reserved;
    uint32_t margin[2]; /* guard band (px) */
    uint32_t reserved_2[2];
} AonetFrame;

/* Views of textures of the program's size, one sample a pixel. Visibility is as large, less the guard band. */
typedef struct AonetTextures {
    WGPUTextureView normals, depth, second, visibility; /* second: NULL unless the program has two layers */
} AonetTextures;

typedef struct AonetProgram AonetProgram;

/* Reads FOLDER/program.json and FOLDER/program.bin, makes buffers and compiles shaders. NULL with a sentence in `error` where the
 * files are wrong or memory is short; what the device has against them is reported to the device. */
AonetProgram *aonet_program_new(WGPUDevice device, const char *folder, WGPUTextureFormat output, char error[256]);

/* Size of its frames (px). */
void aonet_program_size(const AonetProgram *program, uint32_t size[2]);

/* Encodes a frame. Its numbers are written when the commands are submitted: encode one frame a submission. */
void aonet_program_encode(AonetProgram *program, WGPUCommandEncoder encoder, const AonetTextures *textures, const AonetFrame *frame);

void aonet_program_free(AonetProgram *program);

#endif
