/* Sessions in threads and forks, names, versions and precisions. */
#define _POSIX_C_SOURCE 200809L

#include "common.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

enum { RUNS = 4 };

static GBuffer scene;

/* A thread's work: one method, again and again. */
typedef struct Work {
    AonetSession session; /* NULL: one of its own */
    const char *method;
    const float *expected;
    int good;
} Work;

static void *run_often(void *argument) {
    Work *work = argument;
    float *visibility = need(calloc(picture_pixels(&scene), sizeof(float)));
    AonetSessionOptions options = options_of(&scene, work->method);
    options.threads = 2;
    AonetSession session = work->session ? work->session : open_session(&options);
    AonetFrame frame = frame_of(&scene, visibility);
    work->good = 1;
    for (int i = 0; i < RUNS; i++) {
        work->good &= aonetRun(session, &frame) == AONET_OK;
        work->good &= same(visibility, work->expected, picture_pixels(&scene));
    }
    /* Errors of the other thread are not seen here. */
    work->good &= aonetGetError(NULL) == AONET_OK;
    frame.radius = -1.0f;
    work->good &= aonetRun(session, &frame) == AONET_ERROR_INVALID_ARGUMENT;
    if (!work->session) aonetReleaseSession(session);
    free(visibility);
    return NULL;
}

static void in_two_threads(Work *a, Work *b) {
    pthread_t threads[2];
    CHECK(pthread_create(&threads[0], NULL, run_often, a) == 0);
    CHECK(pthread_create(&threads[1], NULL, run_often, b) == 0);
    CHECK(pthread_join(threads[0], NULL) == 0);
    CHECK(pthread_join(threads[1], NULL) == 0);
    CHECK(a->good && b->good);
    CHECK(aonetGetError(NULL) == AONET_OK);
}

static void threads(void) {
    float *network = visibility_of(&scene, "balanced"), *search = visibility_of(&scene, "gtao:tuned");
    CHECK(!same(network, search, picture_pixels(&scene)));
    Work a = {NULL, "balanced", network, 0}, b = {NULL, "gtao:tuned", search, 0};
    in_two_threads(&a, &b);
    /* Two threads that share a session take turns. */
    AonetSessionOptions options = options_of(&scene, "balanced");
    AonetSession shared = open_session(&options);
    Work c = {shared, NULL, network, 0}, d = {shared, NULL, network, 0};
    in_two_threads(&c, &d);
    aonetReleaseSession(shared);
    /* The default number of threads. */
    options.threads = 0;
    float *visibility = need(calloc(picture_pixels(&scene), sizeof(float)));
    AonetSession all = open_session(&options);
    AonetFrame frame = frame_of(&scene, visibility);
    CHECK(aonetRun(all, &frame) == AONET_OK);
    CHECK(same(visibility, network, picture_pixels(&scene)));
    aonetReleaseSession(all);
    free(visibility);
    free(network);
    free(search);
}

/* A fork is told that it has no threads; it would wait for them otherwise. */
static void forks(void) {
    float *visibility = need(calloc(picture_pixels(&scene), sizeof(float)));
    AonetSessionOptions options = options_of(&scene, "agtao");
    options.threads = 2;
    AonetSession session = open_session(&options);
    AonetFrame frame = frame_of(&scene, visibility);
    pid_t child = fork();
    if (child == 0) {
        alarm(60);
        AonetError code = aonetRun(session, &frame);
        const char *message;
        int good = code == AONET_ERROR_INVALID_OPERATION && aonetGetError(&message) == code && strstr(message, "fork");
        aonetReleaseSession(session);
        _exit(good ? 0 : 1);
    }
    int status = -1;
    CHECK(child > 0 && waitpid(child, &status, 0) == child);
    CHECK(WIFEXITED(status) && WEXITSTATUS(status) == 0);
    CHECK(aonetRun(session, &frame) == AONET_OK);
    aonetReleaseSession(session);
    free(visibility);
}

/* Every name that the library lists can be used, and gives an image. */
static void names(void) {
    size_t count = 0;
    int is_tuned = 0;
    for (const char *name; (name = aonetGetMethodName(count)); count++) {
        float *visibility = visibility_of(&scene, name);
        float least = 1.0f, most = 0.0f;
        for (size_t i = 0; i < picture_pixels(&scene); i++) {
            CHECK(visibility[i] >= 0.0f && visibility[i] <= 1.0f);
            least = fminf(least, visibility[i]), most = fmaxf(most, visibility[i]);
        }
        /* Measured: 0.75 at most, of vbao:medium. */
        CHECK(least < 0.8f && most == 1.0f);
        is_tuned |= strcmp(name, "gtao:tuned") == 0;
        free(visibility);
    }
    CHECK(count > 15 && is_tuned);
    CHECK(aonetGetMethodName((size_t)-1) == NULL);
    CHECK(strcmp(aonetGetMethodName(0), "fast") == 0);
}

/* Other precisions are the same but for rounding, or the machine is named as the reason. */
static void precisions(void) {
    float *expected = visibility_of(&scene, "balanced");
    float *visibility = need(calloc(picture_pixels(&scene), sizeof(float)));
    for (int precision = AONET_PRECISION_F32; precision <= AONET_PRECISION_INT8; precision++) {
        AonetSessionOptions options = options_of(&scene, "balanced");
        options.precision = (AonetPrecision)precision;
        AonetSession session = aonetNewSession(&options);
        if (!session) {
            CHECK(precision >= AONET_PRECISION_BF16);
            CHECK_ERROR(1, AONET_ERROR_UNSUPPORTED_HARDWARE, "instructions");
            continue;
        }
        AonetFrame frame = frame_of(&scene, visibility);
        CHECK(aonetRun(session, &frame) == AONET_OK);
        double sum = 0.0;
        for (size_t i = 0; i < picture_pixels(&scene); i++) sum += fabsf(visibility[i] - expected[i]);
        CHECK(sum / (double)picture_pixels(&scene) < (precision == AONET_PRECISION_F32 ? 1e-9 : 0.02));
        aonetReleaseSession(session);
    }
    free(visibility);
    free(expected);
}

int main(void) {
    scene = scene_render(96, 72, 0, 0);
    CHECK(aonetGetVersion() == AONET_VERSION);
    threads();
    forks();
    names();
    precisions();
    gbuffer_free(&scene);
    return finish();
}
