// Steering with a scene: who wins, what is kept, and what it costs.
#include <gtest/gtest.h>

#include <cmath>
#include <deque>

#include "common/cores/Camera.h"
#include "server/sim/frame/Simulation.h"
#include "server/sim/navigation/Steering.h"
#include "tests/unit/sim/SceneForTests.h"

namespace tessera {
namespace {

using test::ListMaker;

/// A floor of boxes, as many as wanted, one metre each; the view stands above the middle.
struct Yard {
    explicit Yard(int side, bool takesInput = true, bool looksBeside = false) : takes(takesInput), later(looksBeside) {
        ListMaker make;
        const ObjectId tile = make.box(Vec3d(1, 0.2, 1));
        for (int x = 0; x < side; ++x)
            for (int z = 0; z < side; ++z)
                (void)make.node("", make.node("", kRootNode, make.transform(Vec3d(x - side / 2, -0.1, z - side / 2))),
                                tile);
        (void)make.node("thing", make.node("place", kRootNode, make.transform(Vec3d(0, 1, -5))), tile);
        const ObjectId carrier = make.node("carrier", kRootNode, make.transform(Vec3d(20, -30, -40)));
        if (later) (void)make.node("sheet", carrier, make.sheet(64));
        EXPECT_TRUE(simulation.load({make.builder.take()}));
        first = findNode(simulation.scene(), "/place/thing").value();
        view.update(simulation.scene(), nullptr);
        stand(Vec3d(0, 0.5, 0));
    }
    void stand(const Vec3d& place) {
        const ViewWish wish{.position = place, .orientation = Quatd::Identity(), .worldUnitsPerMetre = 1};
        EXPECT_TRUE(view.set(simulation.scene(), wish));
    }
    void frames(int count, std::vector<Edit> edits = {}) {
        for (int i = 0; i < count; ++i) {
            const FrameResult made = simulation.step(i == 0 && begin, std::exchange(edits, {}));
            begin = false;
            if (made.commit.list) view.update(simulation.scene(), made.commit.list.get());
            steering.frame(now_ += frame);
            mostWork = std::max(mostWork, steering.work());
        }
    }
    /// So many of what a person calls a second.
    void seconds(double count) {
        frames(static_cast<int>(std::lround(count / std::chrono::duration<double>(frame).count())));
    }
    [[nodiscard]] View now() { return *view.view(simulation.scene()); }
    [[nodiscard]] Vec3d eye() { return now().world_T_wall() * now().users.front().position; }

    /// What the threads beside do.
    void work() {
        while (!besides.empty()) {
            const auto one = std::move(besides.front());
            besides.pop_front();
            one()();
        }
    }
    [[nodiscard]] LooksBeside beside() {
        if (!later) return {};
        return {.look =
                    [this](LooksBeside::Look look) {
                        besides.push_back([this, look] { return look(simulation.scene()); });
                    },
                .work = [this](LooksBeside::Work one) { besides.push_back(std::move(one)); }};
    }

    bool takes, later, begin = true;
    std::deque<LooksBeside::Work> besides;
    Wall wall = test::wallOfOne();
    Simulation simulation;
    ViewSource view{wall, ""};
    Steering steering{{.wall = wall, .simulation = simulation, .view = view, .takesInput = takes, .beside = beside()}};
    ObjectId first;
    std::uint64_t mostWork = 0;
    Duration frame = std::chrono::nanoseconds(16'666'667);
    TimePoint now_ = TimePoint{} + std::chrono::hours(5);
};

InputState ahead() {
    return {.back = -InputState::kFull};
}

TEST(Steering, AHostsKeyMovesTheViewAndItsEndStopsIt) {
    Yard yard(3);
    yard.frames(5);
    const Vec3d from = yard.eye();
    const std::uint64_t version = yard.view.version();
    yard.frames(5);
    EXPECT_EQ(yard.view.version(), version) << "where nobody steers nothing changes";
    yard.steering.received("only", {InputState{}});
    yard.steering.received("only", {ahead()});
    yard.frames(60);
    EXPECT_LT(yard.eye().z(), from.z() - 1);
    EXPECT_EQ(yard.steering.active(), std::vector<std::string>{"only"});
    yard.steering.hostLeft("only");
    yard.frames(120);
    const Vec3d there = yard.eye();
    yard.frames(60);
    EXPECT_EQ(yard.eye(), there);
    EXPECT_TRUE(yard.steering.active().empty());
}

TEST(Steering, WhoSetsTheViewHasThatFrameAndTheFlightGoesOnFromThere) {
    Yard yard(3);
    yard.steering.received("only", {ahead()});
    yard.frames(30);
    EXPECT_TRUE(yard.view.set(yard.simulation.scene(), {.position = Vec3d(50, 60, 70)}));
    yard.frames(1);
    EXPECT_EQ(yard.now().position, Vec3d(50, 60, 70));
    yard.frames(60);
    EXPECT_EQ(yard.now().position.x(), 50);
    EXPECT_LT(yard.now().position.z(), 69);
    EXPECT_GT(yard.now().position.z(), 66);
}

TEST(Steering, ApplicationsAskForModesPlacesAndKeys) {
    using Deed = NavigationWish::Deed;
    Yard yard(3);
    const View begun = yard.now();
    EXPECT_TRUE(yard.steering.asked(7, {.input = ahead()})) << "its first word counts";
    yard.frames(60);
    EXPECT_LT(yard.now().position.z(), begun.position.z() - 1);
    yard.steering.applicationLeft(7);
    yard.frames(120);
    EXPECT_TRUE(yard.steering.asked(7, {.deed = Deed::kKeepBookmark, .bookmark = 2}));
    const View kept = yard.now();
    EXPECT_TRUE(yard.steering.asked(7, {.deed = Deed::kHome}));
    yard.frames(80);
    EXPECT_EQ(yard.now().position, yard.view.home(yard.simulation.scene())->position);
    EXPECT_FALSE(yard.view.state().byHand) << "home is where the camera has it";
    EXPECT_TRUE(yard.steering.asked(7, {.deed = Deed::kGoToBookmark, .bookmark = 2}));
    yard.frames(80);
    EXPECT_EQ(yard.now().position, kept.position);
    EXPECT_TRUE(yard.steering.asked(7, {.deed = Deed::kFit, .node = yard.first}));
    yard.frames(80);
    const Vec3d thing = yard.now().world_T_wall().inverse() * Vec3d(0, 1, -5);
    EXPECT_LT((thing - Vec3d(0, 0.5, 0)).norm(), 1e-6) << "in the middle of the screen";
    EXPECT_TRUE(yard.steering.asked(7, {.mode = NavigationMode::kWalk}));
    EXPECT_EQ(yard.steering.mode(), NavigationMode::kWalk);

    EXPECT_EQ(yard.steering.asked(7, {.deed = Deed::kGoToBookmark, .bookmark = 3}).error().code, ErrorCode::kNotFound);
    EXPECT_EQ(yard.steering.asked(7, {.deed = Deed::kFit, .node = ObjectId(99'999)}).error().code,
              ErrorCode::kNotFound);
    EXPECT_FALSE(yard.steering.asked(7, {.deed = Deed::kGoToBookmark, .bookmark = 0}));
}

TEST(Steering, AnApplicationPointsAtTheFirstScreen) {
    // From the eye through the middle of the screen lies the thing's nearest face: an orbit turns around that.
    Yard yard(3);
    const Vec3d grabbed(0, 1, -4.5);
    yard.stand(Vec3d(0, 1.5, -2.5));
    EXPECT_TRUE(yard.steering.asked(7, {.mode = NavigationMode::kOrbit}));
    yard.frames(1);
    const double before = (yard.eye() - grabbed).norm();
    InputState input;
    input.cursorX = input.cursorY = 32768;
    input.ask(InputAction::kGrab);
    EXPECT_TRUE(yard.steering.asked(7, {.input = input}));
    yard.frames(1);
    input.lookRight += InputState::kUnit / 4;
    EXPECT_TRUE(yard.steering.asked(7, {.input = input}));
    yard.frames(2);
    EXPECT_GT(std::abs(yard.eye().x()), 0.1) << "it has turned";
    EXPECT_NEAR((yard.eye() - grabbed).norm(), before, 1e-3) << "a cursor is told to 1/65535";
}

TEST(Steering, WhereNoInputIsTakenNobodySteers) {
    Yard yard(3, false);
    const View begun = yard.now();
    yard.steering.received("only", {InputState{}});
    yard.steering.received("only", {ahead()});
    yard.steering.add({.move = Vec3d(1, 0, 0)}, "wand right");
    yard.frames(60);
    EXPECT_EQ(yard.now().position, begun.position);
    EXPECT_EQ(yard.steering.asked(7, {.input = ahead()}).error().code, ErrorCode::kRefused);
}

TEST(Steering, AWandIsOneMoreSource) {
    Yard yard(3);
    const Vec3d from = yard.eye();
    for (int i = 0; i < 60; ++i) {
        yard.steering.add({.move = Vec3d(1, 0, 0)}, "wand right");
        yard.frames(1);
    }
    EXPECT_GT(yard.eye().x(), from.x() + 1);
    EXPECT_EQ(yard.steering.active(), std::vector<std::string>{"wand right"});
    yard.frames(60);
    EXPECT_TRUE(yard.steering.active().empty());
}

constexpr double kRates[] = {2, 4, 12.5, 60, 200, 1000};
Duration frameOf(double rate) {
    return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(1 / rate));
}

/// What a person does is timed by the clock, however long the machine's frames are.
TEST(Steering, SpeedsAreThoseOfTheClockAtAnyRateOfFrames) {
    const double speed = Wall().navigation.speed;
    for (const double rate : kRates) {
        SCOPED_TRACE(testing::Message() << rate << " frames a second");
        Yard yard(3);
        yard.frame = frameOf(rate);
        yard.frames(3);
        const Vec3d from = yard.eye();
        yard.steering.received("only", {InputState{}});
        yard.steering.received("only", {ahead()});
        yard.seconds(4);
        // dv/dt = (wanted - v) / tau, from rest.
        const double fades = std::exp(-4 / Navigator::kTau);
        EXPECT_NEAR((from - yard.eye()).z(), speed * (4 - Navigator::kTau * (1 - fades)), 1e-6);
        yard.steering.received("only", {InputState{}});
        EXPECT_FALSE(yard.steering.active().empty());
        yard.seconds(0.5);
        EXPECT_FALSE(yard.steering.active().empty());
        yard.seconds(2.5);
        EXPECT_TRUE(yard.steering.active().empty()) << "a second is one of the clock";
        EXPECT_NEAR((from - yard.eye()).z(), 4 * speed, 1e-3);
    }
}

TEST(Steering, AnEasedWayTakesItsTimeAtAnyRateOfFrames) {
    for (const double rate : kRates) {
        SCOPED_TRACE(testing::Message() << rate << " frames a second");
        Yard yard(3);
        yard.frame = frameOf(rate);
        yard.frames(1);
        EXPECT_TRUE(yard.steering.asked(1, {.deed = NavigationWish::Deed::kHome}));
        const Vec3d home = yard.view.home(yard.simulation.scene())->position;
        int frames = 0;
        for (; yard.now().position != home && frames < 3000; ++frames) yard.frames(1);
        const double seconds = frames / rate;
        EXPECT_GE(seconds, Navigator::kEased - 1e-6);
        EXPECT_LE(seconds, Navigator::kEased + 1 / rate + 1e-6);
    }
}

TEST(Steering, AWalkIsAsFarAtAnyRateOfFrames) {
    const double speed = Wall().navigation.speed;
    for (const double rate : kRates) {
        SCOPED_TRACE(testing::Message() << rate << " frames a second");
        Yard yard(32);
        yard.frame = frameOf(rate);
        EXPECT_TRUE(yard.steering.asked(1, {.mode = NavigationMode::kWalk}));
        yard.seconds(2);  // to the ground
        EXPECT_NEAR(yard.eye().y(), 1.7, 0.02);
        const Vec3d from = yard.eye();
        EXPECT_TRUE(yard.steering.asked(1, {.input = InputState{.right = InputState::kFull}}));
        yard.seconds(2);
        EXPECT_NEAR((yard.eye() - from).x(), speed * (2 - Navigator::kTau), 0.01);
        EXPECT_NEAR(yard.eye().y(), 1.7, 0.02);
    }
}

TEST(Steering, APauseIsNoLeap) {
    Yard yard(3);
    yard.steering.received("only", {ahead()});
    yard.seconds(2);
    const Vec3d from = yard.eye();
    yard.now_ += std::chrono::minutes(10);
    yard.frames(1);
    const double most = std::chrono::duration<double>(Steering::kLongestFrame).count();
    EXPECT_NEAR((from - yard.eye()).z(), Wall().navigation.speed * most, 1e-5);
    const Vec3d there = yard.eye();
    yard.now_ -= std::chrono::minutes(1);  // no steady clock does that
    yard.frames(1);
    EXPECT_EQ(yard.eye(), there);
    EXPECT_TRUE(yard.steering.active() == std::vector<std::string>{"only"});
}

/// Nobody has wanted anything: who falls to the ground at the begin does so alike in each run, whatever its frames
/// take.
TEST(Steering, ARunThatNobodySteersDependsOnNoClock) {
    Wall wall = test::wallOfOne();
    wall.navigation.mode = NavigationMode::kWalk;
    std::vector<Vec3d> first;
    for (const double rate : kRates) {
        Yard yard(16);
        Steering walker{{.wall = wall, .simulation = yard.simulation, .view = yard.view}};
        EXPECT_TRUE(yard.view.set(yard.simulation.scene(), {.position = Vec3d(0, 3, 0)}));
        std::vector<Vec3d> places;
        for (int i = 0; i < 60; ++i) {
            walker.frame(yard.now_ += frameOf(rate));
            places.push_back(yard.now().position);
        }
        EXPECT_NE(places.front(), places.back()) << "it falls";
        if (first.empty()) first = places;
        EXPECT_EQ(places, first) << rate;
    }
}

TEST(Steering, BookmarksAreInWhatAServerGoesOnFrom) {
    Yard yard(2), next(2);
    EXPECT_TRUE(yard.steering.asked(1, {.deed = NavigationWish::Deed::kKeepBookmark, .bookmark = 9}));
    const std::uint64_t version = yard.view.version();
    yard.steering.received("only", {ahead()});
    yard.frames(10);
    EXPECT_GT(yard.view.version(), version) << "a journal hears of a flight";
    next.view.goOnFrom(yard.view.state());
    const Expected<View> kept = next.view.bookmark(next.simulation.scene(), 8);
    ASSERT_TRUE(kept);
    EXPECT_EQ(kept->position, Vec3d(0, 0.5, 0));
    EXPECT_EQ(next.now().position, yard.now().position);
}

/// As a file's viewpoints are: the first is where the wall begins, the others are not enabled.
TEST(Steering, CamerasOfTheSceneAreTheBookmarksThatNobodyHasKept) {
    Yard yard(2);
    ListMaker make;
    const auto camera = [&](const char* name, const Vec3d& place, bool enabled) {
        const ObjectId lens = make.create<Camera>();
        setField<&Camera::enabled>(make.builder, lens, enabled);
        (void)make.node(name, make.node("", kRootNode, make.transform(place)), lens);
    };
    camera("gate", Vec3d(1, 2, 3), true);
    camera("roof", Vec3d(0, 9, 0), false);
    yard.frames(1, {Edit{.list = make.builder.take()}});
    using Deed = NavigationWish::Deed;
    const auto goTo = [&](std::uint32_t number) {
        const Expected<void> went = yard.steering.asked(1, {.deed = Deed::kGoToBookmark, .bookmark = number});
        return went ? std::string() : went.error().message;
    };
    EXPECT_EQ(goTo(2), "");
    yard.seconds(5);
    EXPECT_TRUE(yard.now().position.isApprox(Vec3d(0, 9, 0), 1e-6)) << yard.now().position.transpose();
    InputState keys;
    yard.steering.received("only", {keys});
    yard.frames(1);
    keys.ask(InputAction::kGoTo1);
    yard.steering.received("only", {keys});
    yard.seconds(5);
    EXPECT_TRUE(yard.now().position.isApprox(Vec3d(1, 2, 3), 1e-6)) << yard.now().position.transpose();
    EXPECT_EQ(goTo(3), "nobody has kept a bookmark 3, and the scene has no camera 3");
    EXPECT_EQ(goTo(10), "nobody has kept a bookmark 10, and the scene has no camera 10");
    // What somebody keeps counts before what a file says.
    EXPECT_TRUE(yard.steering.asked(1, {.deed = Deed::kKeepBookmark, .bookmark = 2}));
    EXPECT_EQ(goTo(1), "");
    yard.seconds(5);
    EXPECT_EQ(goTo(2), "");
    yard.seconds(5);
    EXPECT_TRUE(yard.now().position.isApprox(Vec3d(1, 2, 3), 1e-6)) << yard.now().position.transpose();
}

/// In the middle of the wall, whose user looks at the sheet.
NavigationInput pointingAtTheSheet(Yard& yard, InputAction action) {
    yard.stand(Vec3d(52.3, 2.1, 0));
    yard.frames(1);
    return {.actions = {action}, .pointing = Ray{.origin = Vec3d(0, 0, 0), .direction = -Vec3d::UnitZ()}};
}

TEST(Steering, NoFrameWaitsForAFitOfWhatIsLarge) {
    Yard yard(3, true, true);
    const NavigationInput fit = pointingAtTheSheet(yard, InputAction::kFit);
    const View begun = yard.now();
    yard.steering.add(fit, "wand");
    yard.frames(30);
    EXPECT_EQ(yard.now().position, begun.position) << "its tree is not there";
    EXPECT_EQ(yard.besides.size(), 1u) << "made once, however often the question is asked";
    yard.work();
    yard.frames(1);
    EXPECT_EQ(yard.besides.size(), 1u) << "then its bounds";
    yard.work();
    yard.frames(100);
    EXPECT_NE(yard.now().position, begun.position);
    const Vec3d middle = yard.now().world_T_wall().inverse() * Vec3d(52, 2, -40);
    EXPECT_LT((middle - Vec3d(0, 0.5, 0)).norm(), 1e-6) << "in the middle of the screen";
    EXPECT_TRUE(yard.besides.empty());
    // Who steers meanwhile has thought better of it.
    yard.steering.add({.actions = {InputAction::kFitAll}}, "wand");
    yard.frames(1);
    yard.steering.add({.move = Vec3d(0, 0, -1)}, "wand");
    yard.frames(1);
    yard.work();
    yard.frames(200);
    const View stands = yard.now();
    yard.frames(100);
    EXPECT_EQ(yard.now().position, stands.position);
    EXPECT_EQ(yard.now().worldUnitsPerMetre, stands.worldUnitsPerMetre);
}

TEST(Steering, WhatIsGrabbedIsTurnedAroundOnceItIsKnown) {
    Yard yard(3, true, true);
    EXPECT_TRUE(yard.steering.asked(1, {.mode = NavigationMode::kOrbit}));
    yard.steering.add(pointingAtTheSheet(yard, InputAction::kGrab), "wand");
    yard.frames(1);
    EXPECT_EQ(yard.besides.size(), 1u);
    yard.work();
    yard.frames(2);
    EXPECT_TRUE(yard.besides.empty()) << "nobody asks any more";
    const Vec3d held(52.3, 2.1, -40);
    const double before = (yard.eye() - held).norm();
    for (int i = 0; i < 30; ++i) {
        yard.steering.add({.look = Vec2d(0.02, 0)}, "wand");
        yard.frames(1);
    }
    EXPECT_GT((yard.eye() - Vec3d(52.3, yard.eye().y(), 0)).norm(), 1);
    EXPECT_NEAR((yard.eye() - held).norm(), before, 1e-6);
    // Where nothing was grabbed it turns around the middle of all, once that is known. A click of the wheel waits.
    Yard other(3, true, true);
    EXPECT_TRUE(other.steering.asked(1, {.mode = NavigationMode::kOrbit}));
    other.frames(1);
    const View begun = other.now();
    other.steering.add({.wheel = 1}, "wand");
    other.frames(3);
    EXPECT_EQ(other.now().position, begun.position);
    EXPECT_EQ(other.besides.size(), 1u);
    other.work();
    other.frames(60);
    EXPECT_NE(other.now().position, begun.position);
    other.frames(60);
    EXPECT_TRUE(other.besides.empty());
}

TEST(Steering, NobodyWalksBeforeTheGroundIsKnown) {
    Yard yard(3, true, true);
    const Vec3d head = yard.now().users.front().position;
    yard.stand(Vec3d(52.3, 2.1, -39.9) - head);
    yard.frames(1);
    const View begun = yard.now();
    EXPECT_TRUE(yard.steering.asked(1, {.mode = NavigationMode::kWalk, .input = ahead()}));
    yard.frames(60);
    EXPECT_EQ(yard.now().position, begun.position);
    EXPECT_EQ(yard.besides.size(), 1u);
    yard.work();
    yard.frames(60);
    EXPECT_GT(yard.eye().z(), -40) << "and does not come through the sheet";
    EXPECT_LT(yard.eye().z(), -39.6);
    EXPECT_TRUE(yard.besides.empty());
}

TEST(Steering, WhatChangesInEachFrameIsFittedAsItWasWhenSomebodyAsked) {
    Yard yard(3, true, true);
    yard.steering.add(pointingAtTheSheet(yard, InputAction::kFit), "wand");
    const Aspect& scene = yard.simulation.scene();
    const ObjectId shape = scene.get<Node>(findNode(scene, "/carrier/sheet").value())->core;
    const std::span<const float> flat = scene.get<Geometry>(shape)->positions.as<float>();
    std::vector<float> places(flat.begin(), flat.end());
    for (int i = 0; i < 200; ++i) {
        places[2] = 0.001F * static_cast<float>(i + 1);
        ChangeListBuilder builder;
        setField<&Geometry::positions>(builder, shape, Blob::of(std::span<const float>(places)));
        std::vector<Edit> edits;
        edits.push_back({.list = builder.take()});
        yard.frames(1, std::move(edits));
        yard.work();
    }
    const Vec3d middle = yard.now().world_T_wall().inverse() * Vec3d(52, 2, -40);
    EXPECT_LT((middle - Vec3d(0, 0.5, 0)).norm(), 0.01) << "in the middle of the screen";
}

/// The floor is as dense in all yards: a walker looks at what is near and at the way to it, which grows as a logarithm.
TEST(Steering, AWalkCostsWhatIsNear) {
    std::map<int, std::uint64_t> work;
    for (const int side : {32, 316}) {  // 1,000 and 100,000 things
        Yard yard(side);
        EXPECT_TRUE(yard.steering.asked(1, {.mode = NavigationMode::kWalk, .input = ahead()}));
        yard.frames(1);
        yard.mostWork = 0;
        yard.frames(60);
        EXPECT_NEAR(yard.eye().y(), 1.7, 0.02) << "it walks";
        EXPECT_LT(yard.eye().z(), 1.5);
        work[side] = yard.mostWork;
    }
    EXPECT_GT(work[32], 20u);
    EXPECT_LT(work[316], 2 * work[32]) << "a hundred times as much: " << work[32] << " and " << work[316];

    std::printf("boxes and faces looked at in a frame of a walk: %llu among 1,000 things, %llu among 100,000\n",
                static_cast<unsigned long long>(work[32]), static_cast<unsigned long long>(work[316]));
}

}  // namespace
}  // namespace tessera
