/* aonetRun allocates nothing after the first run that has to copy. This program counts what the library asks of malloc; it
 * needs the C library of GNU. */
#include "common.h"

#include <math.h>
#include <stdlib.h>

void *__libc_malloc(size_t size);
void *__libc_calloc(size_t count, size_t size);
void *__libc_realloc(void *memory, size_t size);
void *__libc_memalign(size_t alignment, size_t size);

static int allocations;

static void count(void) { __sync_fetch_and_add(&allocations, 1); }

void *malloc(size_t size) { return count(), __libc_malloc(size); }
void *calloc(size_t items, size_t size) { return count(), __libc_calloc(items, size); }
void *realloc(void *memory, size_t size) { return count(), __libc_realloc(memory, size); }
void *aligned_alloc(size_t alignment, size_t size) { return count(), __libc_memalign(alignment, size); }
int posix_memalign(void **memory, size_t alignment, size_t size) {
    count();
    *memory = __libc_memalign(alignment, size);
    return *memory ? 0 : 12;
}

static int allocations_of_run(AonetSession session, const AonetFrame *frame) {
    const int before = allocations;
    CHECK(aonetRun(session, frame) == AONET_OK);
    return allocations - before;
}

static void method(const GBuffer *g, const char *name) {
    float *visibility = need(malloc(picture_pixels(g) * sizeof(float)));
    float *normal = need(malloc(3 * gbuffer_pixels(g) * sizeof(float)));
    for (size_t i = 0; i < 3 * gbuffer_pixels(g); i++) {
        normal[i] = isinf(g->depth[i / 3]) ? 1.0f : 1.01f * g->normal[i];
    }
    const int before = allocations;
    AonetSessionOptions options = options_of(g, name);
    options.threads = 2;
    AonetSession session = open_session(&options);
    CHECK(allocations > before);
    AonetFrame plain = frame_of(g, visibility), untidy = plain, rows = plain;
    plain.second_depth.data = g->second;
    CHECK(allocations_of_run(session, &plain) == 0);
    untidy.normal.data = normal;
    CHECK(allocations_of_run(session, &untidy) > 0);
    /* Depth from the bottom up: the picture upside down, which is no frame that anybody would want, but one. */
    const size_t columns = g->width + 2 * g->margin_x;
    const ptrdiff_t row = (ptrdiff_t)(columns * sizeof(float));
    rows.depth = (AonetInputImage){g->depth + gbuffer_pixels(g) - columns, 0, -row};
    rows.normal = (AonetInputImage){g->normal + 3 * (gbuffer_pixels(g) - columns), 0, -3 * row};
    CHECK(allocations_of_run(session, &rows) > 0);
    for (int i = 0; i < 3; i++) {
        CHECK(allocations_of_run(session, &plain) == 0);
        CHECK(allocations_of_run(session, &untidy) == 0);
        CHECK(allocations_of_run(session, &rows) == 0);
    }
    aonetReleaseSession(session);
    free(normal);
    free(visibility);
}

int main(void) {
    GBuffer scene = scene_render(96, 64, 8, 4);
    method(&scene, "balanced");
    method(&scene, "high");
    method(&scene, "gtao:tuned");
    method(&scene, "arcs:deep");
    gbuffer_free(&scene);
    return finish();
}
