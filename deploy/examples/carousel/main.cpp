// An application of three threads, each with the scene to itself: one lets things ride around a node, one listens to
// what touches and turns the ride about, and one writes: it alone speaks to the wall. Nobody waits for anybody; what
// they look at never changes under their hands.
//
//     example-carousel HOST:PORT NODE [TURNS]       NODE: what is below it rides around it; TURNS: then it ends (for
//     ever)
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <string>
#include <thread>

#include "common/application/Application.h"
#include "common/base/Channel.h"
#include "common/cores/Transform.h"
#include "common/scene/AspectFeed.h"
#include "common/scene/SideTable.h"

using namespace std::chrono_literals;
using tessera::Aspect;
using tessera::ChangeList;
using tessera::ObjectId;

namespace {

struct Ride {
    std::string node;
    double turns = 0;                                            ///< 0: for ever
    tessera::Channel<ChangeList> wishes{2};                      ///< simulation → writer
    tessera::Channel<tessera::answer::PairEvents> touches{256};  ///< writer → listener
    std::atomic<double> way{1};                                  ///< listener → simulation: 1 or -1
    std::atomic<bool> over = false;
};

int failed(const tessera::Error& error) {
    std::fprintf(stderr, "example-carousel: %s\n", error.message.c_str());
    return exitCode(error.code);
}

/// The simulation. It looks at a scene of its own, which is whole however far the wall has got meanwhile.
void simulate(Ride& ride, std::unique_ptr<tessera::AspectReader> reader) {
    constexpr double kStep = std::numbers::pi / 180;
    constexpr int kPatience = 100;
    int idle = kPatience;
    for (double ridden = 0; !ride.over && (ride.turns == 0 || ridden < 2 * std::numbers::pi * ride.turns);) {
        const auto news = reader->catchUp();
        if (!news) return static_cast<void>(failed(news.error()));
        // A step is from where the last one led. One that nothing came of is tried again.
        if (!*news && ++idle < kPatience) {
            std::this_thread::sleep_for(2ms);
            continue;
        }
        idle = 0;
        ridden += kStep;
        const Aspect& scene = reader->scene();
        const auto hub = findNode(scene, ride.node);
        if (!hub) return static_cast<void>(failed(hub.error()));
        const tessera::Quatd turn(Eigen::AngleAxisd(ride.way * kStep, tessera::Vec3d::UnitY()));
        tessera::ChangeListBuilder step;
        for (const ObjectId child : scene.get<tessera::Node>(*hub)->children)
            if (const auto* body = scene.coreOf<tessera::Transform>(*scene.get<tessera::Node>(child)))
                step.set(scene.get<tessera::Node>(child)->core, tessera::typeOf<tessera::Transform>(),
                         tessera::fieldId<&tessera::Transform::translation>,
                         tessera::toValue(tessera::Vec3d(turn * body->translation)));
        if (!ride.wishes.push(step.take())) return;
    }
    ride.over = true;
}

/// The listener. Names are those that things have in its own scene, which is not older than what it hears of.
void listen(Ride& ride, std::unique_ptr<tessera::AspectReader> reader) {
    while (const auto heard = ride.touches.pop()) {
        if (const auto news = reader->catchUp(); !news) return static_cast<void>(failed(news.error()));
        for (const tessera::PairEventValue& event : heard->events) {
            const bool began = event.phase == tessera::TouchPhase::kBegan;
            if (began) ride.way = -ride.way;
            std::printf("%s %s %s\n", pathOf(reader->scene(), event.objectA).c_str(), began ? "touches" : "leaves",
                        pathOf(reader->scene(), event.objectB).c_str());
        }
    }
}

/// The writer: it follows the wall, publishes what it is told, and proposes what the simulation wants.
int write(Ride& ride, tessera::Application& wall) {
    tessera::AspectFeed feed;
    // How often each thing was moved; what goes takes its number with it.
    tessera::SideTable<unsigned> moves({.changed = [](ObjectId, unsigned& count) { ++count; },
                                        .destroyed =
                                            [](ObjectId id, unsigned count) {
                                                std::printf("#%llu is gone after %u moves\n",
                                                            static_cast<unsigned long long>(id.value), count);
                                            },
                                        .effects = tessera::Effect::kPose});
    const auto hub = findNode(wall.scene(), ride.node);
    if (!hub) return failed(hub.error());
    for (const ObjectId child : wall.scene().get<tessera::Node>(*hub)->children)
        moves.attach(wall.scene().get<tessera::Node>(child)->core, 0);
    wall.onChanges([&](const ChangeList& list, tessera::Sequence) {
        feed.publish(wall.scene(), std::make_shared<const ChangeList>(list));
        moves.follow(wall.scene(), list);
    });
    const auto told = wall.onPairEvents([&](const tessera::answer::PairEvents& frame) {
        // Who does not keep up hears of the newest only: the wall goes on.
        if (!frame.events.empty()) static_cast<void>(ride.touches.tryPush(frame));
    });
    if (!told) return failed(told.error());

    std::jthread simulation(simulate, std::ref(ride), feed.join(wall.scene()));
    std::jthread listener(listen, std::ref(ride), feed.join(wall.scene()));
    int code = 0;
    while (!ride.over && code == 0) {
        if (const auto wish = ride.wishes.popFor(5ms))
            // What was refused speaks of something that has gone meanwhile: the next wish knows.
            if (const auto moved = wall.propose(*wish); !moved && moved.error().code == tessera::ErrorCode::kNetwork)
                code = failed(moved.error());
        if (const auto polled = wall.poll(1ms); !polled) code = failed(polled.error());
    }
    ride.over = true;
    ride.wishes.close();
    ride.touches.close();
    return code;
}

}  // namespace

int main(int argc, char** argv) {
    if (argc < 3 || argc > 4) return failed({tessera::ErrorCode::kUsage, "HOST:PORT NODE [TURNS]"});
    double turns = 0;
    if (argc > 3) {
        char* end = nullptr;
        turns = std::strtod(argv[3], &end);
        if (end == argv[3] || *end != 0 || !(turns > 0))
            return failed({tessera::ErrorCode::kUsage,
                           "TURNS is a number above 0; without it the wheel turns until it is stopped"});
    }
    std::setvbuf(stdout, nullptr, _IOLBF, BUFSIZ);
    auto wall = tessera::Application::connect({.address = argv[1], .name = "carousel"});
    if (!wall) return failed(wall.error());
    Ride ride{.node = argv[2], .turns = turns};
    return write(ride, **wall);
}
