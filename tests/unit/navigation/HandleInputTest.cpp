/// Hands on handles: from the states of windows, terminals and wands to edits of what a manipulator belongs to.
#include "server/sim/navigation/HandleInput.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "common/scene/Edits.h"
#include "server/sim/navigation/Steering.h"
#include "tests/property/Seeds.h"
#include "tests/unit/sim/SceneForTests.h"
#include "tests/unit/sim/SingleEdits.h"

namespace tessera {
namespace {

using test::ListMaker;

/// A cart that stands in the middle of the picture, with arrows; another one beside it, which a motion may drive.
struct Bench {
    explicit Bench(bool takesInput = true, Wall before = test::wallOfOne())
        : takes(takesInput), wall(std::move(before)) {
        ListMaker make;
        for (const auto& [name, x] : {std::pair("cart", 0.0), {"other", 1.2}}) {
            const ObjectId place = make.transform(kCart + Vec3d(x, 0, 0));
            const ObjectId cart = make.node(name, kRootNode, place);
            (void)make.node("load", cart, make.box(Vec3d::Constant(0.1)));
            const ObjectId manipulator = make.create<Manipulator>();
            setField<&Manipulator::target>(make.builder, manipulator, cart);
            setField<&Manipulator::size>(make.builder, manipulator, 1.0);
            (void)make.node(std::string("handles of ") + name, kRootNode, manipulator);
            if (x == 0) continue;
            const ObjectId motion = make.motion(place, {{0, 1.2, -0.7, -2.4}, {1e6, 2, -0.7, -2.4}});
            setField<&Motion::playing>(make.builder, motion, false);
            (void)make.node("motion", kRootNode, motion);
        }
        EXPECT_TRUE(simulation.load({make.builder.take()}));
        view.update(simulation.scene(), nullptr);
        EXPECT_TRUE(view.set(simulation.scene(),
                             {.position = Vec3d::Zero(), .orientation = Quatd::Identity(), .worldUnitsPerMetre = 1}));
        frames(2);
    }
    /// As the desk and the frame loop do it.
    void frames(int count, std::vector<Edit> others = {}) {
        for (int i = 0; i < count; ++i) {
            std::vector<Edit> edits = std::exchange(others, {});
            if (std::ranges::none_of(edits, isStep, &Edit::kind)) {
                for (Edit& edit : steering.takeEdits()) edits.push_back(std::move(edit));
                if (ChangeList held = drags.corrections(simulation.scene(), simulation.manipulators()); !held.empty())
                    edits.push_back({.ticket = 5, .list = std::move(held), .undoable = false});
            }
            const FrameResult made = simulation.step(std::exchange(begin, false), std::move(edits));
            for (const EditOutcome& outcome : made.outcomes)
                EXPECT_TRUE(outcome.result) << outcome.result.error().message;
            if (made.commit.list) view.update(simulation.scene(), made.commit.list.get());
            steering.frame(now += std::chrono::milliseconds(16));
        }
    }
    void say(InputState next) { steering.received("only", {state = next}); }
    /// Where a place of the world stands in the picture.
    [[nodiscard]] static Vec2d cursorOf(const Vec3d& at) {
        const Vec3d eye(0, 1.7, 2.4), seen = eye + (at - eye) * (2.4 / (2.4 - at.z()));
        return {(seen.x() + 1) / 2, 1 - seen.y()};
    }
    static InputState pressed(InputState before, const Vec3d& at) {
        const Vec2d cursor = cursorOf(at);
        before.cursorX = static_cast<std::uint16_t>(std::lround(cursor.x() * 65535));
        before.cursorY = static_cast<std::uint16_t>(std::lround(cursor.y() * 65535));
        ++before.asked[kHandTakes];
        before.ask(InputAction::kGrab);
        before.held |= kHandHolds;
        return before;
    }
    static InputState dragged(InputState before, const Vec3d& from, const Vec3d& to) {
        const Vec2d way = cursorOf(to) - cursorOf(from);  // a picture of as many pixels in both directions
        before.lookRight += static_cast<std::uint64_t>(std::llround(way.x() * InputState::kUnit));
        before.lookDown += static_cast<std::uint64_t>(std::llround(way.y() * InputState::kUnit));
        return before;
    }
    static InputState released(InputState before) {
        before.held &= ~kHandHolds;
        return before;
    }
    /// What is grabbed is the skin of an arrow, up to a hundredth of the way nearer than its middle, which is aimed at;
    /// a cursor has 65,536 places.
    static double bound(double way) { return 0.01 * way + 2e-4; }
    [[nodiscard]] Vec3d moved(const char* name = "/cart") const {
        return test::placeOf(simulation.scene(), name) - kCart;
    }
    [[nodiscard]] View stands() { return *view.view(simulation.scene()); }
    [[nodiscard]] std::int64_t held(const char* name = "/handles of cart") const {
        const Aspect& scene = simulation.scene();
        return scene.coreOf<Manipulator>(*scene.get<Node>(findNode(scene, name).value()))->held;
    }
    [[nodiscard]] bool remarks(const std::string& words) {
        for (const std::string& remark : steering.takeRemarks())
            if (remark.find(words) != std::string::npos) return true;
        return false;
    }

    inline static const Vec3d kCart{0, -0.7, -2.4};
    inline static const Vec3d kUpArrow = kCart + Vec3d(0, 0.4, 0);

    bool takes, begin = true;
    Wall wall;
    Simulation simulation;
    ViewSource view{wall, ""};
    ManipulatorDrags drags;
    Steering steering{{.wall = wall, .simulation = simulation, .view = view, .takesInput = takes, .drags = &drags}};
    InputState state;
    TimePoint now = TimePoint{} + std::chrono::hours(5);
};

TEST(HandleInput, ADragOfAHandleMovesItsTargetAndNotTheView) {
    Bench bench;
    const View before = bench.stands();
    bench.say({});
    bench.say(Bench::pressed(bench.state, Bench::kUpArrow));
    bench.frames(1);
    EXPECT_NE(bench.held(), 0) << "seen on the wall";
    for (int i = 1; i <= 5; ++i) {
        bench.say(Bench::dragged(bench.state, Bench::kUpArrow + Vec3d(0, 0.05 * (i - 1), 0),
                                 Bench::kUpArrow + Vec3d(0, 0.05 * i, 0)));
        bench.frames(1);
        EXPECT_NEAR(bench.moved().y(), 0.05 * i, bench.bound(0.05 * i));
    }
    EXPECT_EQ(bench.moved().x(), 0) << "along the arrow alone";
    bench.say(Bench::released(bench.state));
    bench.frames(60);
    EXPECT_EQ(bench.held(), 0);
    EXPECT_EQ(bench.stands().position, before.position);
    EXPECT_EQ(bench.stands().orientation.coeffs(), before.orientation.coeffs());
    EXPECT_EQ(bench.simulation.history().undoDepth(), 1u) << "five edits are one gesture";
    // What comes then is the view's again.
    bench.say(Bench::dragged(bench.state, Vec3d(0, 0, 0), Vec3d(0.2, 0.1, 0)));
    bench.frames(60);
    EXPECT_NE(bench.stands().orientation.coeffs(), before.orientation.coeffs());
    EXPECT_NEAR(bench.moved().y(), 0.25, bench.bound(0.25));
    bench.frames(2, test::one(Edit::Kind::kUndo));
    EXPECT_EQ(bench.moved().norm(), 0);
}

TEST(HandleInput, BesideHandlesADragIsTheViews) {
    Bench bench, other;
    for (Bench* each : {&bench, &other}) each->say({});
    const Vec3d nothing = Bench::kCart + Vec3d(-1, 0.3, 0);
    bench.say(Bench::pressed(bench.state, nothing));
    bench.say(Bench::dragged(bench.state, nothing, nothing + Vec3d(0.3, 0, 0)));
    // The same of a window that knows nothing of handles.
    InputState plain = Bench::dragged(Bench::pressed({}, nothing), nothing, nothing + Vec3d(0.3, 0, 0));
    plain.held = 0;
    plain.asked[kHandTakes] = 0;
    other.say(plain);
    for (Bench* each : {&bench, &other}) each->frames(60);
    EXPECT_EQ(bench.moved().norm(), 0);
    EXPECT_EQ(bench.stands().orientation.coeffs(), other.stands().orientation.coeffs());
    EXPECT_NE(bench.stands().orientation.coeffs(), Quatd::Identity().coeffs());
    EXPECT_EQ(bench.simulation.history().undoDepth(), 0u);
}

/// Whoever carries states may leave out all but the newest.
TEST(HandleInput, WhatIsLostOnTheWayChangesNothing) {
    forSeeds(25, [](Random& random) {
        Bench whole, some;
        std::vector<InputState> said{InputState{}};
        const auto next = [&](const InputState& state) { said.push_back(state); };
        next(Bench::pressed(said.back(), Bench::kUpArrow));
        Vec3d hand = Bench::kUpArrow;
        for (std::size_t steps = 1 + below(random, 8); steps > 0; --steps) {
            const auto way = [&] { return static_cast<double>(below(random, 1001)) / 1000 - 0.5; };
            const Vec3d to = hand + 0.4 * Vec3d(way(), way(), 0);
            InputState state = Bench::dragged(said.back(), hand, to);
            if (oneIn(random, 3)) {  // Shift makes other sums of it
                state.panRight += std::exchange(state.lookRight, said.back().lookRight) - said.back().lookRight;
                state.panDown += std::exchange(state.lookDown, said.back().lookDown) - said.back().lookDown;
            }
            next(state);
            hand = to;
        }
        next(Bench::released(said.back()));
        for (std::size_t i = 0; i < said.size(); ++i) {
            const bool last = i + 1 == said.size();
            whole.say(said[i]);
            if (i == 0 || last || oneIn(random, 3)) some.say(said[i]);
            if (last || oneIn(random, 2)) whole.frames(1);
            if (last || oneIn(random, 2)) some.frames(1);
        }
        for (Bench* each : {&whole, &some}) each->frames(2);
        EXPECT_LT((whole.moved() - some.moved()).norm(), 1e-9);
        EXPECT_NE(whole.moved().y(), 0);
        for (Bench* each : {&whole, &some}) {
            EXPECT_EQ(each->held(), 0);
            EXPECT_LE(each->simulation.history().undoDepth(), 1u);
            EXPECT_EQ(each->stands().orientation.coeffs(), Quatd::Identity().coeffs());
            EXPECT_EQ(each->stands().position, Vec3d(0, 0, 0));
        }
    });
}

TEST(HandleInput, WhoComesSecondIsToldAndMovesNothing) {
    Bench bench;
    bench.say({});
    bench.say(Bench::pressed(bench.state, Bench::kUpArrow));
    bench.frames(1);
    // Another one, who sits at a terminal.
    InputState terminal = Bench::pressed({}, Bench::kUpArrow);
    EXPECT_TRUE(bench.steering.asked(3, {.input = terminal}));
    bench.frames(1);
    EXPECT_TRUE(bench.remarks("application 3: somebody else holds /handles of cart"));
    const View before = bench.stands();
    terminal.lookDown += 1000;
    EXPECT_TRUE(bench.steering.asked(3, {.input = terminal}));
    bench.frames(10);
    EXPECT_EQ(bench.moved().norm(), 0);
    EXPECT_EQ(bench.stands().orientation.coeffs(), before.orientation.coeffs())
        << "a hand that was refused does not turn the view instead";
    // Once the first one's host is gone, cut off or not, the other one may.
    bench.steering.hostLeft("only");
    bench.frames(2);
    EXPECT_EQ(bench.held(), 0);
    ++terminal.asked[kHandTakes];
    EXPECT_TRUE(bench.steering.asked(3, {.input = terminal}));
    bench.frames(1);
    EXPECT_NE(bench.held(), 0);
    bench.steering.applicationLeft(3);
    bench.frames(2);
    EXPECT_EQ(bench.held(), 0);
}

TEST(HandleInput, WhatIsDrivenSaysSo) {
    Bench bench;
    const ObjectId motion =
        bench.simulation.scene().get<Node>(findNode(bench.simulation.scene(), "/motion").value())->core;
    const auto play = [&](bool playing) {
        ChangeListBuilder list;
        setField<&Motion::playing>(list, motion, playing);
        bench.frames(1, test::one(list.take()));
    };
    const Vec3d arrow = Bench::kUpArrow + Vec3d(1.2, 0, 0);
    bench.say({});
    play(true);
    bench.say(Bench::pressed(bench.state, arrow));
    EXPECT_TRUE(bench.remarks("only: /other is driven by Motion"));
    bench.say(Bench::dragged(bench.state, arrow, arrow + Vec3d(0, 0.2, 0)));
    bench.frames(2);
    EXPECT_NEAR(bench.moved("/other").y(), 0, 1e-12);
    bench.say(Bench::released(bench.state));
    play(false);
    bench.say(Bench::pressed(bench.state, arrow));
    bench.say(Bench::dragged(bench.state, arrow, arrow + Vec3d(0, 0.1, 0)));
    bench.frames(1);
    EXPECT_NEAR(bench.moved("/other").y(), 0.1, bench.bound(0.1));
    // What begins to play while it is held takes it out of the hand, and that is said.
    play(true);
    bench.say(Bench::dragged(bench.state, arrow, arrow + Vec3d(0, 0.1, 0)));
    bench.frames(2);
    EXPECT_TRUE(bench.remarks("is driven by Motion"));
    EXPECT_EQ(bench.held("/handles of other"), 0);
}

TEST(HandleInput, WhatIsRemovedWhileItIsHeldIsHeldNoLonger) {
    for (const bool target : {true, false}) {
        Bench bench;
        bench.say({});
        bench.say(Bench::pressed(bench.state, Bench::kUpArrow));
        bench.say(Bench::dragged(bench.state, Bench::kUpArrow, Bench::kUpArrow + Vec3d(0, 0.2, 0)));
        bench.frames(1);
        const Aspect& scene = bench.simulation.scene();
        ChangeListBuilder list;
        if (target) {
            // Nothing that is named goes: the manipulator loses its target, then that is moved away.
            const ObjectId manipulator = scene.get<Node>(findNode(scene, "/handles of cart").value())->core;
            setField<&Manipulator::target>(list, manipulator, ObjectId());
            bench.frames(1, test::one(list.take()));
        } else {
            Expected<ChangeList> removal = removalList(scene, findNode(scene, "/handles of cart").value());
            ASSERT_TRUE(removal);
            bench.frames(1, test::one(std::move(*removal)));
        }
        const Vec3d there = bench.moved();
        bench.say(Bench::dragged(bench.state, Bench::kUpArrow, Bench::kUpArrow + Vec3d(0, 0.2, 0)));
        bench.frames(3);
        EXPECT_EQ(bench.moved(), there);
        EXPECT_TRUE(bench.remarks("is not there any more"));
        EXPECT_FALSE(bench.drags.holds(1));
    }
}

TEST(HandleInput, AnUndoWhileItIsHeldTakesBackWhatWasDragged) {
    Bench bench;
    bench.say({});
    bench.say(Bench::pressed(bench.state, Bench::kUpArrow));
    bench.say(Bench::dragged(bench.state, Bench::kUpArrow, Bench::kUpArrow + Vec3d(0, 0.2, 0)));
    bench.frames(1);
    bench.frames(2, test::one(Edit::Kind::kUndo));
    EXPECT_EQ(bench.moved().norm(), 0);
    EXPECT_EQ(bench.simulation.history().undoDepth(), 0u);
    // The hand still holds it, and leads on from where it is.
    bench.say(Bench::dragged(bench.state, Bench::kUpArrow, Bench::kUpArrow + Vec3d(0, 0.1, 0)));
    bench.frames(1);
    EXPECT_NEAR(bench.moved().y(), 0.3, bench.bound(0.3));
    bench.say(Bench::released(bench.state));
    bench.frames(2);
    EXPECT_EQ(bench.simulation.history().undoDepth(), 1u);
    bench.frames(2, test::one(Edit::Kind::kUndo));
    EXPECT_EQ(bench.moved().norm(), 0);
}

/// A screen at the side, drawn for the right eye: the ray is that eye's. From between the eyes it would pass the arrow
/// by.
TEST(HandleInput, ARayBeginsAtTheEyeThatTheTileIsDrawnFor) {
    Wall wall = test::wallOfOne();
    Screen side = wall.screens.front();
    wall.users.front().eyeSeparationMetres = 0.4;  // wider than an arrow is thick
    side.name = "side";
    side.lowerLeft = Vec3d(1, 0, 0);
    side.lowerRight = Vec3d(1, 0, 2);
    side.upperLeft = Vec3d(1, 1, 0);
    wall.screens.push_back(side);
    wall.hosts.push_back({"left", {{"side", 0, 0, Eye::kLeft, "viewer"}}});
    wall.hosts.push_back({"right", {{"side", 0, 0, Eye::kRight, "viewer"}}});
    const Expected<void> sound = checkWall(wall);
    ASSERT_TRUE(sound) << sound.error().message;
    for (const Eye eye : {Eye::kRight, Eye::kCenter}) {
        Bench bench(true, wall);
        const Vec3d from = wall.users.front().eye(eye), cart = from + 2 * (Vec3d(1, 0.5, 1) - from);
        bench.frames(2, test::one(test::moveTo(test::transformAt(bench.simulation.scene(), "/cart"), cart)));
        const auto cursorAt = [&](const Vec3d& at) {
            const Vec3d seen = from + (at - from) * ((1 - from.x()) / (at.x() - from.x()));
            return Vec2d(seen.z() / 2, 1 - seen.y());
        };
        const Vec2d press = cursorAt(cart + Vec3d(0, 0.4, 0)), to = cursorAt(cart + Vec3d(0, 0.6, 0));
        InputState hand;
        bench.steering.received("right", {hand});
        hand.cursorX = static_cast<std::uint16_t>(std::lround(press.x() * 65535));
        hand.cursorY = static_cast<std::uint16_t>(std::lround(press.y() * 65535));
        ++hand.asked[kHandTakes];
        hand.held = kHandHolds;
        bench.steering.received("right", {hand});
        bench.frames(1);
        EXPECT_EQ(bench.held() != 0, eye == Eye::kRight);
        hand.lookRight += static_cast<std::uint64_t>(std::llround((to.x() - press.x()) * InputState::kUnit));
        hand.lookDown += static_cast<std::uint64_t>(std::llround((to.y() - press.y()) * InputState::kUnit));
        bench.steering.received("right", {hand});
        bench.frames(1);
        if (eye == Eye::kRight)
            EXPECT_NEAR(test::placeOf(bench.simulation.scene(), "/cart").y() - cart.y(), 0.2, bench.bound(0.2));
    }
}

TEST(HandleInput, AWandsFirstButtonTakesHold) {
    Bench bench;
    const auto wandAt = [](const Vec3d& at, std::uint32_t buttons) {
        const Vec3d from(0.3, 0.2, 1);
        return WandState{.name = "right",
                         .tracked = true,
                         .worldPosition = from,
                         .worldOrientation = Quatd::FromTwoVectors(-Vec3d::UnitZ(), at - from),
                         .buttons = buttons};
    };
    const auto frame = [&](const WandState& wand) {
        bench.steering.wands({wand});
        bench.frames(1);
    };
    frame(wandAt(Bench::kUpArrow, 2));
    EXPECT_EQ(bench.held(), 0) << "another button";
    frame(wandAt(Bench::kUpArrow, 1));
    EXPECT_NE(bench.held(), 0);
    frame(wandAt(Bench::kUpArrow + Vec3d(0, 0.15, 0), 1));
    EXPECT_NEAR(bench.moved().y(), 0.15, bench.bound(0.15));
    frame(wandAt(Bench::kUpArrow + Vec3d(0, 0.25, 0), 1));
    WandState silent = wandAt(Bench::kUpArrow + Vec3d(0, 0.5, 0), 0);
    silent.tracked = false;
    frame(silent);
    bench.frames(1);
    EXPECT_EQ(bench.held(), 0) << "one that is silent has no buttons";
    EXPECT_NEAR(bench.moved().y(), 0.25, bench.bound(0.25));
    EXPECT_EQ(bench.simulation.history().undoDepth(), 1u);
    WandState nowhere = wandAt(Bench::kUpArrow, 1);
    nowhere.worldPosition.x() = std::nan("");
    frame(nowhere);
    EXPECT_EQ(bench.held(), 0);
    EXPECT_NEAR(bench.moved().y(), 0.25, bench.bound(0.25));
}

TEST(HandleInput, WhereNoInputIsTakenNobodyTakesHold) {
    Bench bench(false);
    bench.say({});
    bench.say(Bench::pressed(bench.state, Bench::kUpArrow));
    bench.steering.wands(
        {WandState{.name = "right", .tracked = true, .worldPosition = Vec3d(0, -0.3, 0), .buttons = 1}});
    bench.frames(2);
    EXPECT_EQ(bench.held(), 0);
}

/// Any states of any sources in any order, while others edit and undo: nobody holds what is not there, and who leaves
/// holds nothing.
TEST(HandleInput, AnyStatesLeaveNothingHeldWhenAllHaveGone) {
    forSeeds(30, [](Random& random) {
        Bench bench;
        std::map<std::uint32_t, InputState> states;
        for (int i = 0; i < 60; ++i) {
            InputState& state = states[static_cast<std::uint32_t>(below(random, 3))];
            state.source = static_cast<std::uint32_t>(below(random, 3) == 0 ? random() : 0);
            const Vec3d at = Bench::kUpArrow + Vec3d(static_cast<double>(below(random, 3)) * 0.6, 0, 0);
            const std::uint32_t source = state.source;
            switch (below(random, 6)) {
                case 0:
                case 1:
                    state = Bench::pressed(state, at);
                    break;
                case 2:
                    state = Bench::dragged(state, at, at + Vec3d(0.1, 0.2, 0));
                    break;
                case 3:
                    state = Bench::released(state);
                    break;
                case 4:
                    state.lookDown = random(), state.asked[kHandTakes] = static_cast<std::uint16_t>(random());
                    break;
                default:
                    bench.steering.hostLeft(oneIn(random, 2) ? "only" : "stranger");
                    break;
            }
            state.source = source;
            bench.steering.received(oneIn(random, 8) ? "stranger" : "only", {state});
            if (oneIn(random, 8))
                bench.frames(
                    1, bench.simulation.history().undoDepth() > 0 ? test::one(Edit::Kind::kUndo) : std::vector<Edit>());
            if (oneIn(random, 2)) bench.frames(1);
        }
        bench.steering.hostLeft("only");
        bench.steering.hostLeft("stranger");
        bench.frames(2);
        EXPECT_EQ(bench.held(), 0);
        EXPECT_EQ(bench.held("/handles of other"), 0);
        EXPECT_TRUE(bench.moved().allFinite());
        while (bench.simulation.history().undoDepth() > 0) bench.frames(1, test::one(Edit::Kind::kUndo));
        bench.frames(1);
        EXPECT_EQ(bench.moved().norm(), 0);
    });
}

}  // namespace
}  // namespace tessera
