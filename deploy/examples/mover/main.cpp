// A node is moved 60 times a second, in one of two manners.
//
//     example-mover HOST:PORT NODE paced|queued [COUNT]       COUNT: so many places, then it ends (for ever)
//
// Paced: a place for each frame that the wall shows. The movement is even, and on a slow wall it takes longer.
// Queued: places come by a clock of their own, as a sensor's do, and wait for nobody. The newest one is sent. On a slow
// wall the movement keeps its time, and some places are never seen.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <string>
#include <thread>

#include "common/application/Application.h"
#include "common/base/Channel.h"
#include "common/cores/Transform.h"

using namespace std::chrono_literals;
using tessera::Application;
using tessera::Expected;
using tessera::ObjectInfo;
using tessera::Vec3d;

namespace {

constexpr double kRate = 60;  // places a second

/// Half a metre to and fro, once in four seconds.
Vec3d swing(int place) {
    return Vec3d(0.5 * std::sin(place / kRate * std::acos(-1.0) / 2), 0, 0);
}

struct Moved {
    Application& wall;
    ObjectInfo node;
    Vec3d start;

    /// Returns when the frame that does it has been made.
    [[nodiscard]] Expected<void> to(const Vec3d& offset) const {
        const auto committed = wall.moveNode(node, {.translation = Vec3d(start + offset)});
        return committed ? Expected<void>() : tl::unexpected(committed.error());
    }
};

/// One place for each frame: the wall is the clock.
Expected<int> paced(const Moved& moved, int count) {
    int place = 0;
    for (; count == 0 || place < count; ++place) {
        if (const auto frame = moved.wall.waitForFrame(10s); !frame) return tl::unexpected(frame.error());
        if (const auto done = moved.to(swing(place)); !done) return tl::unexpected(done.error());
    }
    return place;
}

/// Places wait in a queue of one, where a newer one takes the older one's place: what is sent is never stale.
Expected<int> queued(const Moved& moved, int count) {
    tessera::Channel<Vec3d> newest{1};
    std::jthread sensor([&](const std::stop_token& over) {
        auto tick = std::chrono::steady_clock::now();
        for (int place = 0; !over.stop_requested() && (count == 0 || place < count); ++place) {
            std::this_thread::sleep_until(tick += std::chrono::microseconds(static_cast<int>(1e6 / kRate)));
            if (newest.tryPush(swing(place))) continue;
            (void)newest.tryPop();
            (void)newest.tryPush(swing(place));
        }
        newest.close();
    });
    int sent = 0;
    while (const auto place = newest.pop()) {
        if (const auto done = moved.to(*place); !done) return tl::unexpected(done.error());
        ++sent;
    }
    return sent;
}

int failed(const tessera::Error& error) {
    std::fprintf(stderr, "example-mover: %s\n", error.message.c_str());
    return exitCode(error.code);
}

}  // namespace

int main(int argc, char** argv) {
    const std::string manner = argc > 3 ? argv[3] : "";
    if (argc > 5 || (manner != "paced" && manner != "queued")) {
        std::fprintf(stderr, "usage: example-mover HOST:PORT NODE paced|queued [COUNT]\n");
        return exitCode(tessera::ErrorCode::kUsage);
    }
    // It asks for one node, and is not sent the scene.
    const auto wall = Application::connect({.address = argv[1], .name = "mover", .followScene = false});
    if (!wall) return failed(wall.error());
    const auto node = (*wall)->describeNode(argv[2]);
    if (!node) return failed(node.error());
    const auto told = (*wall)->fetch(std::span(&node->movable, 1));
    if (!told) return failed(told.error());
    const auto* transform = told->coreOf(node->movable).as<tessera::Transform>();
    if (transform == nullptr)
        return failed({tessera::ErrorCode::kNotFound, node->path + " has no Transform that could be moved"});

    const Moved moved{**wall, *node, transform->translation};
    const int count = argc > 4 ? std::max(0, std::atoi(argv[4])) : 0;
    const Expected<int> sent = manner == "paced" ? paced(moved, count) : queued(moved, count);
    if (!sent) return failed(sent.error());
    if (const auto back = moved.to(Vec3d::Zero()); !back) return failed(back.error());
    std::printf("moved %s %d times, %s\n", node->path.c_str(), *sent, manner.c_str());
    return 0;
}
