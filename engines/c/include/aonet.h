/* aonet: ambient occlusion learned from traced rays from depth and normals, on the processor.
 *
 * A session is a network or a classic method for pictures of one size, with its memory and its threads:
 *
 *     AonetSessionOptions options = {0};
 *     options.struct_size = sizeof options;
 *     options.width = 1280;
 *     options.height = 720;
 *     AonetSession session = aonetNewSession(&options);
 *
 *     AonetFrame frame = {0};
 *     frame.struct_size = sizeof frame;
 *     frame.fov_y = 1.0f;
 *     frame.radius = 0.5f;
 *     frame.depth.data = depth;
 *     frame.normal.data = normals;
 *     frame.visibility.data = visibility;
 *     if (aonetRun(session, &frame) != AONET_OK) {
 *         const char *message;
 *         aonetGetError(&message);
 *         fprintf(stderr, "%s\n", message);
 *     }
 *     aonetReleaseSession(session);
 *
 * Fields that stay 0 have their default. Set struct_size of every struct to its sizeof: the library refuses a program
 * that was compiled with a header of another version.
 *
 * Every function may be called on every thread. Two threads that use the same session take turns. A session belongs to
 * the process that made it: after fork, the child makes its own.
 *
 * View space is right-handed: x to the right, y up, and the camera looks along -z. Rows are counted from the top. */
#ifndef AONET_H
#define AONET_H

#include <stddef.h>
#include <stdint.h>

/* Version of this header: 10000 * major + 100 * minor + patch. */
#define AONET_VERSION 100

#ifndef AONET_API
#define AONET_API extern
#endif

#ifdef __cplusplus
extern "C" {
#endif

typedef enum AonetError {
    AONET_OK = 0,
    /* An argument, a field or a pixel is out of its range. */
    AONET_ERROR_INVALID_ARGUMENT = 1,
    /* Weights cannot be read, or are not a network. */
    AONET_ERROR_INVALID_WEIGHTS = 2,
    /* This machine has no instructions for the chosen precision. */
    AONET_ERROR_UNSUPPORTED_HARDWARE = 3,
    AONET_ERROR_OUT_OF_MEMORY = 4,
    /* The session belongs to another process, or an earlier run of it ended with AONET_ERROR_INTERNAL. */
    AONET_ERROR_INVALID_OPERATION = 5,
    /* A mistake in this library. */
    AONET_ERROR_INTERNAL = 6
} AonetError;

/* The numbers that a network multiplies. Classic methods compute in 32-bit floats. */
typedef enum AonetPrecision {
    /* 32-bit floats: every machine, and results that hardly depend on it. */
    AONET_PRECISION_F32 = 0,
    /* The fastest one of this machine that costs no quality: bfloat16 where there are instructions for it. */
    AONET_PRECISION_FASTEST = 1,
    /* bfloat16: AVX-512 BF16. */
    AONET_PRECISION_BF16 = 2,
    /* 8-bit integers: AVX-512 VNNI, and weights that know their ranges. */
    AONET_PRECISION_INT8 = 3
} AonetPrecision;

typedef struct AonetSessionImpl *AonetSession;

typedef struct AonetSessionOptions {
    size_t struct_size;
    /* Size of the picture in pixels, 1 to 32768. */
    size_t width;
    size_t height;
    /* Guard band in pixels: so many columns left and as many right, so many rows above and as many below. Depth and
     * normals then have width + 2 margin_x columns and height + 2 margin_y rows; visibility has the picture's size. */
    size_t margin_x;
    size_t margin_y;
    /* At most one of the next three. A network or a classic method by name: "fast", "balanced" (the default), "high",
     * "gtao:tuned", ...; aonetGetMethodName lists all. */
    const char *method;
    /* A network of your own: the path of its .safetensors file (UTF-8 on Windows), ... */
    const char *weights_path;
    /* ... or the bytes of that file. They are not needed after aonetNewSession. */
    const void *weights;
    size_t weights_size;
    /* Threads, the caller's included, up to 1024. 0: as many as this process may use cores. Results do not depend on
     * their number. */
    size_t threads;
    AonetPrecision precision;
} AonetSessionOptions;

/* Pixels that are read, or written. Strides are in bytes, multiples of 4. data points to the upper left pixel and is
 * aligned to 4 bytes. */
typedef struct AonetInputImage {
    const float *data;
    /* From a pixel to the next one of its row, at least the size of a pixel. 0: no gap. */
    ptrdiff_t pixel_stride;
    /* From a row to the next one below, at least the size of a row. Negative where rows lie from the bottom up (data
     * still points to the upper row). 0: no gap. */
    ptrdiff_t row_stride;
} AonetInputImage;

typedef struct AonetOutputImage {
    float *data;
    ptrdiff_t pixel_stride;
    ptrdiff_t row_stride;
} AonetOutputImage;

typedef struct AonetFrame {
    size_t struct_size;
    /* One float for each pixel: distance along the axis of the view (not along the ray), in world units, > 0; infinity
     * where there is nothing. */
    AonetInputImage depth;
    /* Three floats for each pixel: unit normals, in view space or, with view_from_world, in world space. Ignored where
     * depth is infinite. */
    AonetInputImage normal;
    /* Optional (data may be NULL): depth of a surface behind the first one, nowhere in front of it. The networks
     * "balanced" and "high" and the methods "arcs" and "vbao" read it. */
    AonetInputImage second_depth;
    /* One float for each pixel of the picture: from 0 (closed) to 1 (open, and where there is nothing). It may be an
     * input as well: it is written after everything has been read, and only if the run succeeds. */
    AonetOutputImage visibility;
    /* The camera of the picture, without its guard band: one of the next two.
     * 16 floats, column by column, for column vectors: a perspective or orthographic projection matrix, off-centre or
     * not. Its third row (depth) is not read. With focal lengths fx, fy and a principal point (cx, cy) in pixels from
     * the upper left corner: [0] = 2 fx / width, [5] = 2 fy / height, [8] = 1 - 2 cx / width, [9] = 2 cy / height - 1,
     * [11] = -1, the others 0. */
    const float *clip_from_view;
    /* Optional: 16 floats, column by column, for column vectors: the rigid transform from world to view space. If it is
     * there, normals are in world space. */
    const float *view_from_world;
    /* Vertical field of view in radians, of a camera with square pixels and its axis in the middle of the picture. 0:
     * clip_from_view is the camera. */
    float fov_y;
    /* How far occluders count, in world units, > 0. Every method but the network "paper" reads it. */
    float radius;
} AonetFrame;

/* Makes a session. Returns NULL if it cannot; aonetGetError then has the reason. */
AONET_API AonetSession aonetNewSession(const AonetSessionOptions *options);

/* Writes the visibility of a frame. Allocates nothing, except in the first run that has to copy an image: one with gaps or
 * rows from the bottom up, normals in world space, or normals that are not of unit length or not 0 where there is nothing. */
AONET_API AonetError aonetRun(AonetSession session, const AonetFrame *frame);

/* Ends the session's threads and frees its memory. NULL is ignored. */
AONET_API void aonetReleaseSession(AonetSession session);

/* Returns the last error of this thread since the last call of this function, and points *message (unless message is
 * NULL) to a sentence about it, which is valid until the next error of this thread. AONET_OK and "" if there was none. */
AONET_API AonetError aonetGetError(const char **message);

/* The name of a network or classic method with this index, from 0 on; NULL after the last one. */
AONET_API const char *aonetGetMethodName(size_t index);

/* Version of the library, as AONET_VERSION. */
AONET_API uint32_t aonetGetVersion(void);

#ifdef __cplusplus
}
#endif

#endif
