/* A size for which there is no memory is an error, and the program goes on. */
#include "common.h"

#include <stdlib.h>
#include <sys/resource.h>

int main(void) {
    const struct rlimit limit = {(rlim_t)400 << 20, (rlim_t)400 << 20};
    CHECK(setrlimit(RLIMIT_AS, &limit) == 0);
    const char *const methods[] = {"balanced", "high", "gtao", "arcs", "ssao"};
    GBuffer large = {12000, 10000, 0, 0, 1.0f, NULL, NULL, NULL, NULL};
    for (size_t i = 0; i < sizeof methods / sizeof *methods; i++) {
        AonetSessionOptions options = options_of(&large, methods[i]);
        CHECK_ERROR(aonetNewSession(&options) == NULL, AONET_ERROR_OUT_OF_MEMORY, "available");
    }
    GBuffer scene = scene_render(64, 48, 0, 0);
    free(visibility_of(&scene, "balanced"));
    gbuffer_free(&scene);
    return finish();
}
