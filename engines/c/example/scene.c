#include "scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

typedef struct Vec {
    float x, y, z;
} Vec;

typedef struct Hit {
    float depth;
    Vec normal, colour;
} Hit;

typedef struct Ball {
    Vec centre;
    float radius;
    Vec colour;
} Ball;

typedef struct Box {
    Vec low, high, colour;
} Box;

static const Vec EYE = {3.2f, 2.6f, 5.2f}, TARGET = {0.0f, 0.65f, 0.0f};
static const Vec FLOOR_COLOUR = {0.72f, 0.70f, 0.66f};
/* Things that are nearer to each other than this are one layer. */
static const float SEPARATION = 0.05f;

static const Ball BALLS[] = {
    {{-0.9f, 0.7f, 0.6f}, 0.7f, {0.80f, 0.45f, 0.35f}},
    {{0.35f, 0.4f, 1.5f}, 0.4f, {0.40f, 0.60f, 0.75f}},
    {{-0.05f, 1.65f, -0.65f}, 0.45f, {0.85f, 0.75f, 0.40f}},
    {{1.75f, 0.25f, 0.9f}, 0.25f, {0.50f, 0.70f, 0.45f}},
};

static const Box BOXES[] = {
    {{-0.6f, 0.0f, -1.2f}, {0.5f, 1.2f, -0.1f}, {0.75f, 0.75f, 0.75f}},
    {{0.9f, 0.0f, -0.9f}, {1.6f, 2.1f, -0.2f}, {0.65f, 0.62f, 0.70f}},
    {{1.05f, 0.0f, 0.35f}, {1.45f, 0.5f, 0.75f}, {0.70f, 0.55f, 0.45f}},
    {{-3.0f, 0.0f, -2.2f}, {3.0f, 1.6f, -2.0f}, {0.78f, 0.76f, 0.72f}},
    {{-2.4f, 0.0f, -1.4f}, {-1.9f, 0.9f, 1.4f}, {0.60f, 0.66f, 0.62f}},
};

static Vec add(Vec a, Vec b) { return (Vec){a.x + b.x, a.y + b.y, a.z + b.z}; }
static Vec scale(Vec a, float s) { return (Vec){a.x * s, a.y * s, a.z * s}; }
static Vec sub(Vec a, Vec b) { return add(a, scale(b, -1.0f)); }
static float dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static Vec cross(Vec a, Vec b) {
    return (Vec){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static Vec unit(Vec a) { return scale(a, 1.0f / sqrtf(dot(a, a))); }

static void take(Hit *best, float least, float depth, Vec normal, Vec colour) {
    if (depth > least && depth < best->depth) *best = (Hit){depth, normal, colour};
}

static void meet_ball(Hit *best, float least, Vec way, const Ball *ball) {
    Vec from = sub(EYE, ball->centre);
    float a = dot(way, way), b = dot(from, way), c = dot(from, from) - ball->radius * ball->radius;
    float root = b * b - a * c;
    if (root < 0.0f) return;
    for (int side = -1; side <= 1; side += 2) {
        float depth = (-b + (float)side * sqrtf(root)) / a;
        Vec point = add(EYE, scale(way, depth));
        take(best, least, depth, unit(sub(point, ball->centre)), ball->colour);
    }
}

static void meet_box(Hit *best, float least, Vec way, const Box *box) {
    const float from[3] = {EYE.x, EYE.y, EYE.z}, step[3] = {way.x, way.y, way.z};
    const float low[3] = {box->low.x, box->low.y, box->low.z}, high[3] = {box->high.x, box->high.y, box->high.z};
    float depth[2] = {-INFINITY, INFINITY}, normal[2][3] = {{0}, {0}};
    for (int axis = 0; axis < 3; axis++) {
        if (step[axis] == 0.0f && (from[axis] < low[axis] || from[axis] > high[axis])) return;
        if (step[axis] == 0.0f) continue;
        float sign = step[axis] > 0.0f ? 1.0f : -1.0f;
        float enter = ((sign > 0.0f ? low[axis] : high[axis]) - from[axis]) / step[axis];
        float leave = ((sign > 0.0f ? high[axis] : low[axis]) - from[axis]) / step[axis];
        for (int end = 0; end < 2; end++) {
            float found = end ? leave : enter;
            if (end ? found >= depth[1] : found <= depth[0]) continue;
            depth[end] = found;
            for (int k = 0; k < 3; k++) normal[end][k] = k == axis ? (end ? sign : -sign) : 0.0f;
        }
    }
    if (depth[0] >= depth[1]) return;
    for (int end = 0; end < 2; end++) {
        take(best, least, depth[end], (Vec){normal[end][0], normal[end][1], normal[end][2]}, box->colour);
    }
}

/* The nearest thing that is farther than `least`. */
static Hit meet(Vec way, float least) {
    Hit best = {INFINITY, {0.0f, 0.0f, 0.0f}, {0.75f, 0.85f, 0.95f}};
    if (way.y < 0.0f) take(&best, least, -EYE.y / way.y, (Vec){0.0f, 1.0f, 0.0f}, FLOOR_COLOUR);
    for (size_t i = 0; i < sizeof BALLS / sizeof *BALLS; i++) meet_ball(&best, least, way, &BALLS[i]);
    for (size_t i = 0; i < sizeof BOXES / sizeof *BOXES; i++) meet_box(&best, least, way, &BOXES[i]);
    return best;
}

static void store(float *to, float x, float y, float z) { to[0] = x, to[1] = y, to[2] = z; }

void *need(void *memory) {
    if (memory) return memory;
    fputs("not enough memory\n", stderr);
    exit(2);
}

size_t gbuffer_pixels(const GBuffer *g) { return (g->width + 2 * g->margin_x) * (g->height + 2 * g->margin_y); }

GBuffer scene_render(size_t width, size_t height, size_t margin_x, size_t margin_y) {
    GBuffer g = {width, height, margin_x, margin_y, 0.75f, NULL, NULL, NULL, NULL};
    size_t columns = width + 2 * margin_x, pixels = gbuffer_pixels(&g);
    g.depth = need(calloc(pixels, sizeof(float)));
    g.normal = need(calloc(3 * pixels, sizeof(float)));
    g.second = need(calloc(pixels, sizeof(float)));
    g.colour = need(calloc(3 * pixels, sizeof(float)));
    Vec ahead = unit(sub(TARGET, EYE)), right = unit(cross(ahead, (Vec){0.0f, 1.0f, 0.0f}));
    Vec up = cross(right, ahead);
    float slope = 2.0f * tanf(0.5f * g.fov_y) / (float)height;
    for (size_t i = 0; i < pixels; i++) {
        float x = ((float)(i % columns) + 0.5f - (float)margin_x - 0.5f * (float)width) * slope;
        float y = (0.5f * (float)height + (float)margin_y - (float)(i / columns) - 0.5f) * slope;
        /* A step along the axis is a step of length 1 along the ray. */
        Vec way = add(ahead, add(scale(right, x), scale(up, y)));
        Hit first = meet(way, 0.0f);
        g.depth[i] = first.depth;
        g.second[i] = isinf(first.depth) ? INFINITY : meet(way, first.depth + SEPARATION).depth;
        store(&g.colour[3 * i], first.colour.x, first.colour.y, first.colour.z);
        Vec n = first.normal;
        if (!isinf(first.depth)) store(&g.normal[3 * i], dot(n, right), dot(n, up), -dot(n, ahead));
    }
    return g;
}

void gbuffer_free(GBuffer *g) {
    free(g->depth);
    free(g->normal);
    free(g->second);
    free(g->colour);
    g->depth = g->normal = g->second = g->colour = NULL;
}
