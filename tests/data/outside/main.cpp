// Moves a node of a running wall along x, a step a frame; or follows one until its x is GOAL, and tells of contacts.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "common/application/Application.h"
#include "common/cores/Transform.h"

using namespace std::chrono_literals;

static int failed(const tessera::Error& error) {
    std::fprintf(stderr, "outside: %s\n", error.message.c_str());
    return exitCode(error.code);
}

static int move(tessera::Application& wall, const std::string& node, double distance, int steps) {
    const tessera::NodeMove step{.translation = tessera::Vec3d(distance / steps, 0, 0), .relative = true};
    for (int i = 0; i < steps; ++i) {
        const auto moved = wall.moveNode(node, step);
        if (!moved) return failed(moved.error());
        std::printf("step %d of %d%s\n", i + 1, steps, moved->stopped.empty() ? "" : ": stopped by what it hit");
    }
    return 0;
}

static int follow(tessera::Application& wall, const std::string& node, double goal) {
    const auto found = findNode(wall.scene(), node);
    if (!found) return failed(found.error());
    tessera::Vec3d last = tessera::Vec3d::Constant(std::nan(""));
    const auto look = [&] {
        const auto* here = wall.scene().get<tessera::Node>(*found);
        const auto* transform = here ? wall.scene().coreOf<tessera::Transform>(*here) : nullptr;
        if (transform == nullptr || transform->translation == last) return;
        last = transform->translation;
        std::printf("%s is at %.17g %.17g %.17g\n", node.c_str(), last.x(), last.y(), last.z());
    };
    look();
    wall.onChanges([&](const tessera::ChangeList&, tessera::Sequence) { look(); });
    const auto told = wall.onPairEvents([&](const tessera::answer::PairEvents& frame) {
        for (const tessera::PairEventValue& event : frame.events)
            std::printf("%s %s %s\n", pathOf(wall.scene(), event.objectA).c_str(),
                        event.phase == tessera::TouchPhase::kBegan ? "touches" : "leaves",
                        pathOf(wall.scene(), event.objectB).c_str());
    });
    while (told && !(std::abs(last.x() - goal) < 1e-6))
        if (const auto polled = wall.poll(1s); !polled) return failed(polled.error());
    return told ? 0 : failed(told.error());
}

int main(int argc, char** argv) {
    const std::string role = argc > 2 ? argv[2] : "";
    if (!(role == "mover" && argc == 6) && !(role == "follower" && argc == 5))
        return failed({tessera::ErrorCode::kUsage, "HOST:PORT mover NODE DISTANCE STEPS | follower NODE GOAL"});
    std::setvbuf(stdout, nullptr, _IOLBF, BUFSIZ);
    auto wall = tessera::Application::connect({.address = argv[1], .name = role});
    if (!wall) return failed(wall.error());
    if (role == "mover") return move(**wall, argv[3], std::atof(argv[4]), std::max(1, std::atoi(argv[5])));
    return follow(**wall, argv[3], std::atof(argv[4]));
}
