/// Who holds which handle: refusals in words, and what becomes of a hold when the scene changes below it.
#include "server/manipulators/ManipulatorDrags.h"

#include <gtest/gtest.h>

#include <limits>

#include "common/scene/Edits.h"
#include "tests/unit/manipulators/ManipulatorScene.h"

namespace tessera {
namespace {

constexpr std::uint64_t kAnna = 1, kBert = 2;

/// A box with arrows of half a unit, seen along -Z.
struct Workbench : ManipulatorScene {
    Workbench() {
        core = transform({});
        target = node(core);
        (void)box(target, Vec3d(0.2, 0.2, 0.2));
        manipulate(Manipulator::kMove, target);
        setField<&Manipulator::size>(edit, manipulator, 1.0);
        setField<&Node::name>(edit, target, std::string("cart"));
        setField<&Node::name>(edit, manipulatorNode, std::string("arrows"));
        apply();
        frame();
    }
    static Ray rayAt(double x, double y) { return {.origin = Vec3d(x, y, 5), .direction = -Vec3d::UnitZ()}; }
    Expected<ManipulatorDrags::Held> grab(std::uint64_t who, double x, double y) {
        return drags.grab(scene, display, who, rayAt(x, y), drivers);
    }
    Expected<ChangeList> drag(std::uint64_t who, double x, double y) {
        return drags.drag(scene, who, rayAt(x, y), drivers);
    }
    void corrected() {
        if (ChangeList list = drags.corrections(scene, display); !list.empty()) apply(std::move(list));
    }
    [[nodiscard]] std::int64_t held() const { return scene.get<Manipulator>(manipulator)->held; }
    [[nodiscard]] double height() const { return scene.get<Transform>(core)->translation.y(); }

    std::vector<ObjectId> driving;
    ManipulatorDrags::Drivers drivers = [this](const ChangeList&) { return driving; };
};

std::string wordsOf(const auto& outcome) {
    return outcome ? std::string() : outcome.error().message;
}

TEST(ManipulatorDrags, WhereNoHandleIsNothingIsHeld) {
    Workbench bench;
    const auto missed = bench.grab(kAnna, 3, 3);
    ASSERT_TRUE(missed);
    EXPECT_FALSE(missed->any);
    EXPECT_FALSE(bench.drags.holds(kAnna));
    EXPECT_EQ(wordsOf(bench.drag(kAnna, 0, 1)), "no handle is held: grab one first");
    const auto refusal = [&](const Ray& ray) {
        return bench.drags.grab(bench.scene, bench.display, kAnna, ray, bench.drivers).error().code;
    };
    const double none = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(refusal({.origin = Vec3d(0, none, 0), .direction = Vec3d::UnitZ()}), ErrorCode::kBadInput);
    EXPECT_EQ(refusal({.origin = Vec3d::Zero(), .direction = Vec3d::Zero()}), ErrorCode::kBadInput);
}

TEST(ManipulatorDrags, TheSecondIsToldWhoeverHoldsIt) {
    Workbench bench;
    ASSERT_TRUE(bench.grab(kAnna, 0, 0.4)->any);
    EXPECT_EQ(wordsOf(bench.grab(kBert, 0, 0.4)), "somebody else holds /arrows");
    EXPECT_EQ(wordsOf(bench.grab(kBert, 0.4, 0)), "somebody else holds /arrows") << "nor by another of its handles";
    EXPECT_TRUE(bench.drags.holds(kAnna)) << "and who has it goes on";
    // Another manipulator of the same target.
    bench.manipulate(Manipulator::kRotate, bench.target);
    setField<&Manipulator::size>(bench.edit, bench.manipulator, 3.0);
    bench.apply();
    bench.frame();
    bool refused = false;
    for (double x = 1.3; x < 1.6 && !refused; x += 0.01)
        refused = wordsOf(bench.grab(kBert, x, 0)) == "/cart is held by /arrows, which somebody else drags";
    EXPECT_TRUE(refused);
    bench.drags.release(kAnna);
    EXPECT_TRUE(bench.grab(kBert, 0, 0.4)->any);
}

/// Two users see arrows of half a unit and of two units: each takes hold of what they see.
TEST(ManipulatorDrags, ARayTakesWhatTheNearestHeadSees) {
    Workbench bench;
    bench.seenAs(std::array{1.0f, 4.0f});
    bench.apply();
    const Vec3d anna(0, 0, 5), bert(9, 0, 5);
    bench.drags.headsAre({anna, bert});
    const auto takes = [&](const Vec3d& head, double height) {
        const auto held = bench.drags.grab(bench.scene, bench.display, kAnna,
                                           {.origin = head, .direction = Vec3d(0, height, 0) - head}, bench.drivers);
        return held && held->any;
    };
    EXPECT_TRUE(takes(anna, 0.4));
    EXPECT_FALSE(takes(anna, 1.6)) << "there is nothing for her";
    EXPECT_TRUE(takes(bert, 1.6));
    EXPECT_TRUE(takes(bert + Vec3d(0.03, 0, 0), 1.6)) << "an eye";
}

TEST(ManipulatorDrags, WhatIsDrivenIsNotTakenAndNotKept) {
    Workbench bench;
    const ObjectId motion = bench.create(typeOf<Motion>());
    bench.apply();
    bench.driving = {motion};
    EXPECT_EQ(wordsOf(bench.grab(kAnna, 0, 0.4)),
              "/cart is driven by Motion #" + std::to_string(motion.value) +
                  ", which plays: pause that first (playing), and the handle can be dragged");
    EXPECT_FALSE(bench.drags.holds(kAnna));
    bench.driving.clear();
    ASSERT_TRUE(bench.grab(kAnna, 0, 0.4)->any);
    bench.driving = {motion};
    EXPECT_EQ(bench.drag(kAnna, 0, 0.8).error().code, ErrorCode::kRefused);
    EXPECT_FALSE(bench.drags.holds(kAnna));
}

TEST(ManipulatorDrags, WhatGoesWhileItIsHeldIsSaidToBeGone) {
    for (const int what : {0, 1, 2}) {
        Workbench bench;
        ASSERT_TRUE(bench.grab(kAnna, 0, 0.4)->any);
        bench.corrected();
        EXPECT_NE(bench.held(), 0);
        if (what == 0) {
            bench.apply(removalOf(bench.scene, std::array{bench.manipulatorNode}));
        } else if (what == 1) {
            setField<&Manipulator::target>(bench.edit, bench.manipulator, ObjectId());
            bench.apply();
            bench.apply(removalOf(bench.scene, std::array{bench.target}));
        } else {
            setField<&Node::core>(bench.edit, bench.target, bench.transform({}));  // what it moves is another one
            bench.apply();
        }
        EXPECT_EQ(wordsOf(bench.drag(kAnna, 0, 0.8)),
                  "the manipulator that was held, or what it moves, is not there any more")
            << what;
        EXPECT_FALSE(bench.drags.holds(kAnna));
        bench.corrected();
        if (what != 0) EXPECT_EQ(bench.held(), 0);
        EXPECT_EQ(wordsOf(bench.drag(kAnna, 0, 0.8)), "no handle is held: grab one first");
    }
}

TEST(ManipulatorDrags, CorrectionsLetGoOfWhatIsGoneWithoutADrag) {
    Workbench bench;
    ASSERT_TRUE(bench.grab(kAnna, 0, 0.4)->any);
    bench.apply(removalOf(bench.scene, std::array{bench.manipulatorNode}));
    bench.corrected();
    EXPECT_FALSE(bench.drags.holds(kAnna));
}

TEST(ManipulatorDrags, WhoeverGoesOnAfterAnEndOfTheServerHoldsNothing) {
    Workbench bench;
    ASSERT_TRUE(bench.grab(kAnna, 0, 0.4)->any);
    bench.corrected();
    bench.frame();
    EXPECT_NE(bench.held(), 0);
    // The scene is all that a journal has of it.
    bench.drags = ManipulatorDrags();
    bench.display = ManipulatorDisplay();
    bench.display.sceneChanged(bench.scene, nullptr);
    bench.corrected();
    EXPECT_EQ(bench.held(), 0);
    bench.frame();
    EXPECT_EQ(wordsOf(bench.drag(kAnna, 0, 1)), "no handle is held: grab one first");
    EXPECT_TRUE(bench.grab(kBert, 0, 0.4)->any) << "and anybody may take it";
}

TEST(ManipulatorDrags, EachGrabIsAGestureOfItsOwn) {
    Workbench bench;
    EXPECT_EQ(bench.drags.gesture(kAnna), 0u);
    ASSERT_TRUE(bench.grab(kAnna, 0, 0.4)->any);
    const std::uint64_t first = bench.drags.gesture(kAnna);
    ASSERT_TRUE(bench.grab(kAnna, 0, 0.4)->any) << "who takes hold again lets go first";
    EXPECT_NE(bench.drags.gesture(kAnna), first);
    EXPECT_NE(bench.drags.gesture(kAnna), 0u);
    // A drag that leads nowhere says nothing; back to where it was grabbed says so.
    ASSERT_TRUE(bench.drag(kAnna, 0, 0.4));
    EXPECT_TRUE(bench.drag(kAnna, 0, 0.4)->empty());
    bench.apply(*bench.drag(kAnna, 0, 0.9));
    EXPECT_NEAR(bench.height(), 0.5, 1e-9);
    bench.apply(*bench.drag(kAnna, 0, 0.4));
    EXPECT_NEAR(bench.height(), 0, 1e-9);
}

}  // namespace
}  // namespace tessera
