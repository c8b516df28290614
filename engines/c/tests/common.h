/* What the tests share. A program ends with finish(), which is 0 if every check held. */
#ifndef COMMON_H
#define COMMON_H

#include <aonet.h>

#include "scene.h"

#define CHECK(condition) check((condition) != 0, #condition, __FILE__, __LINE__)

/* Checks that a call failed with this code, and that the sentence about it holds the text. */
#define CHECK_ERROR(call, code, text) check_error((int)(call) != 0, code, text, #call, __FILE__, __LINE__)

void check(int good, const char *condition, const char *file, int line);
void check_error(int failed, AonetError code, const char *text, const char *call, const char *file, int line);
int finish(void);

/* Options and a frame for a scene; everything that is not said is the default. */
AonetSessionOptions options_of(const GBuffer *g, const char *method);
AonetFrame frame_of(const GBuffer *g, float *visibility);

/* A session, or the end of the program. */
AonetSession open_session(const AonetSessionOptions *options);

/* Runs a method in one thread; the picture's visibility, to be freed. */
float *visibility_of(const GBuffer *g, const char *method);

size_t picture_pixels(const GBuffer *g);

/* Whether all values are the same, bit by bit. */
int same(const float *a, const float *b, size_t count);

#endif
