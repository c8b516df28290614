// The C++ wrapper: sessions that release themselves, move and throw.
#include <aonet.hpp>

extern "C" {
#include "common.h"
}

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

static_assert(sizeof(aonet::Frame) == sizeof(AonetFrame), "no fields of its own");
static_assert(!std::is_copy_constructible<aonet::Session>::value, "a session has one owner");
static_assert(std::is_nothrow_move_constructible<aonet::Session>::value, "a session can be moved");

template <typename Call> static void check_throws(Call call, AonetError code, const std::string &text) {
    try {
        call();
        CHECK(!"an exception");
    } catch (const aonet::Error &error) {
        CHECK(error.code() == code);
        CHECK(std::string(error.what()).find(text) != std::string::npos);
    }
}

int main() {
    GBuffer scene = scene_render(80, 60, 0, 0);
    float *expected = visibility_of(&scene, "gtao:tuned");
    std::vector<float> visibility(picture_pixels(&scene));

    aonet::SessionOptions options(scene.width, scene.height);
    options.method = "gtao:tuned";
    aonet::Session first(options);
    aonet::Session session = std::move(first);
    aonet::Frame frame;
    frame.depth.data = scene.depth;
    frame.normal.data = scene.normal;
    frame.visibility.data = visibility.data();
    frame.fov_y = scene.fov_y;
    frame.radius = 0.8f;
    session.run(frame);
    CHECK(std::equal(visibility.begin(), visibility.end(), expected));

    check_throws([&] { first.run(frame); }, AONET_ERROR_INVALID_ARGUMENT, "found NULL");
    frame.radius = NAN;
    check_throws([&] { session.run(frame); }, AONET_ERROR_INVALID_ARGUMENT, "radius");
    options.method = "no such method";
    check_throws([&] { aonet::Session none(options); }, AONET_ERROR_INVALID_ARGUMENT, "no such method");

    const std::vector<std::string> names = aonet::methods();
    CHECK(std::count(names.begin(), names.end(), "balanced") == 1);
    CHECK(std::count(names.begin(), names.end(), "arcs:deep") == 1);

    std::free(expected);
    gbuffer_free(&scene);
    return finish();
}
