// aonet for C++17: sessions that release themselves and throw. aonet.h describes all fields.
#ifndef AONET_HPP
#define AONET_HPP

#include "aonet.h"

#include <cstddef>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace aonet {

// Why something could not be done.
class Error : public std::runtime_error {
public:
    Error(AonetError code, const char *message) : std::runtime_error(message), code_(code) {}
    AonetError code() const noexcept { return code_; }

    // The last error of this thread.
    static Error last() {
        const char *message = "";
        const AonetError code = aonetGetError(&message);
        return Error(code, message);
    }

private:
    AonetError code_;
};

// AonetSessionOptions with its size filled in.
struct SessionOptions : AonetSessionOptions {
    SessionOptions(std::size_t width_px, std::size_t height_px) : AonetSessionOptions{} {
        struct_size = sizeof(AonetSessionOptions);
        width = width_px;
        height = height_px;
    }
};

// AonetFrame with its size filled in.
struct Frame : AonetFrame {
    Frame() : AonetFrame{} { struct_size = sizeof(AonetFrame); }
};

// A network or classic method for pictures of one size. It can be moved.
class Session {
public:
    // Throws Error.
    explicit Session(const AonetSessionOptions &options) : session_(aonetNewSession(&options)) {
        if (!session_) throw Error::last();
    }

    // Writes the visibility of a frame. Throws Error.
    void run(const AonetFrame &frame) {
        if (aonetRun(session_.get(), &frame) != AONET_OK) throw Error::last();
    }

    AonetSession get() const noexcept { return session_.get(); }

private:
    struct Release {
        void operator()(AonetSession session) const noexcept { aonetReleaseSession(session); }
    };
    std::unique_ptr<AonetSessionImpl, Release> session_;
};

// The names of all networks and classic methods.
inline std::vector<std::string> methods() {
    std::vector<std::string> names;
    while (const char *name = aonetGetMethodName(names.size())) names.emplace_back(name);
    return names;
}

} // namespace aonet

#endif
