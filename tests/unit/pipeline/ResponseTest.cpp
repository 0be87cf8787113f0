// Slide, rollback and bounce, through the whole pipeline. Stopping has a file of its own.
#include <gtest/gtest.h>

#include <numbers>

#include "server/collision/objects/Relation.h"
#include "tests/unit/pipeline/SceneMaker.h"

namespace tessera {
namespace {

struct RespondingBox : SceneMaker {
    Body box = body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d::Zero());
    Body wall = body(kRootNode, shapes::box(Vec3d(0.2, 10, 10)), Vec3d(5.1, 0, 0));

    void respond(std::int64_t response) {
        Interest fields;
        fields.object = box.node;
        fields.response = response;
        interest(fields);
    }
};

TEST(Slide, AlongAWallWhatIsLeftOfTheMotionGoesOn) {
    RespondingBox scene;
    scene.respond(Interest::kSlide);
    const StepResult result = scene.frame({{.transform = scene.box.transform, .translation = Vec3d(10, 2, 1)}});
    const Vec3d at = scene.at(scene.box.transform).translation;
    EXPECT_NEAR(at.x(), 4.5, 1e-3);
    EXPECT_LT(at.x(), 4.5);
    EXPECT_NEAR(at.y(), 2, 1e-3);
    EXPECT_NEAR(at.z(), 1, 1e-3);
    EXPECT_EQ(result.stopped.size(), 1u) << "it is not where it was wanted";
    EXPECT_FALSE(result.contacts.empty());
}

TEST(Slide, InSmallStepsGoesAsFarAsInOne) {
    RespondingBox scene;
    scene.respond(Interest::kSlide);
    for (int i = 1; i <= 100; ++i) {
        const Vec3d now = scene.at(scene.box.transform).translation;
        scene.frame({{.transform = scene.box.transform, .translation = now + Vec3d(0.1, 0.02, 0)}});
    }
    EXPECT_NEAR(scene.at(scene.box.transform).translation.x(), 4.5, 1e-3);
    EXPECT_NEAR(scene.at(scene.box.transform).translation.y(), 2, 5e-3);
}

/// Two boxes that run into each other, and a third that has nothing to do with it but is part of the interest.
TEST(Rollback, EverybodyGoesBackToTheFirstTimeOfContact) {
    SceneMaker scene;
    const ObjectId group = scene.node(kRootNode);
    std::vector<SceneMaker::Body> boxes;
    for (int i = 0; i < 3; ++i) {
        boxes.push_back(scene.body(group, shapes::box(Vec3d::Ones()), Vec3d(4.0 * i, 0, 0)));
        CollisionObject object;
        object.node = boxes.back().node;
        scene.object(object);
    }
    Interest fields;
    fields.object = fields.against = group;
    fields.response = Interest::kRollback;
    scene.interest(fields);
    // 0 and 1 close their gap of 3 with 2 + 4 per frame: they meet at half of it.
    const StepResult result = scene.frame({{.transform = boxes[0].transform, .translation = Vec3d(4, 0, 0)},
                                           {.transform = boxes[1].transform, .translation = Vec3d(2, 0, 0)},
                                           {.transform = boxes[2].transform, .translation = Vec3d(8, 6, 0)}});
    EXPECT_NEAR(scene.at(boxes[0].transform).translation.x(), 2, 2e-3);
    EXPECT_NEAR(scene.at(boxes[1].transform).translation.x(), 3, 2e-3);
    EXPECT_NEAR(scene.at(boxes[2].transform).translation.y(), 3, 2e-3);
    EXPECT_EQ(result.stopped.size(), 3u);
    ASSERT_FALSE(result.contacts.empty()) << "what made them go back is told";
    EXPECT_EQ(result.contacts.front().objectA, boxes[0].shape);
    EXPECT_EQ(result.contacts.front().objectB, boxes[1].shape);
    EXPECT_NEAR(result.contacts.front().time, 0.5, 1e-3);
    EXPECT_EQ(result.events.size(), 1u);
}

TEST(Rollback, WhatTheWorkWasNotEnoughForIsBlockedButNotSaidToTouch) {
    CollisionLimits limits;
    limits.maxTests = 40;
    SceneMaker scene(limits);
    const auto a = scene.body(kRootNode, shapes::sphere(1, 40, 80), Vec3d::Zero());
    scene.body(kRootNode, shapes::sphere(1, 40, 80), Vec3d(2.5, 0.3, 0));
    Interest fields;
    fields.object = a.node;
    fields.response = Interest::kRollback;
    scene.interest(fields);
    const StepResult result = scene.frame({{.transform = a.transform, .translation = Vec3d(4, 0, 0)}});
    EXPECT_EQ(result.stopped, std::vector{a.transform});
    EXPECT_GE(result.counters.notLookedAt, 1u);
    EXPECT_TRUE(result.contacts.empty());
    EXPECT_TRUE(result.events.empty());
}

/// A unit ball-like hull, free, above a floor.
struct Bouncing : SceneMaker {
    Body ball = body(kRootNode, shapes::sphere(0.5, 16, 24), Vec3d(0, 3, 0));
    Body floor = body(kRootNode, shapes::box(Vec3d(20, 1, 20)), Vec3d(0, -0.5, 0));
    ObjectId core;

    explicit Bouncing(double restitution, std::int64_t response = Interest::kBounce) {
        gravity(Vec3d(0, -9.81, 0));
        CollisionObject object;
        object.node = ball.node;
        object.shape = CollisionObject::kHull;
        object.mass = 2;
        object.restitution = restitution;
        core = this->object(object);
        CollisionObject still;
        still.node = floor.node;
        still.kind = CollisionObject::kStatic;
        still.restitution = 0;
        this->object(still);
        Interest fields;
        fields.object = ball.node;
        fields.response = response;
        interest(fields);
    }
    double height() { return at(ball.transform).translation.y(); }
};

TEST(Bounce, AFreeBodyFallsAsGalileoSays) {
    Bouncing scene(0.5);
    for (int frame = 0; frame < 30; ++frame) scene.frame();
    EXPECT_NEAR(3 - scene.height(), 9.81 / 2 * 0.25, 0.01 * 9.81 / 2 * 0.25);
    EXPECT_NEAR(scene.aspect.get<CollisionObject>(scene.core)->velocity.y(), -9.81 / 2, 1e-9);
}

TEST(Bounce, RisesToTheHeightThatItsRestitutionAllows) {
    Bouncing scene(0.5);
    double lowest = 3, highest = 0;
    for (int frame = 0; frame < 90; ++frame) {
        scene.frame();
        lowest = std::min(lowest, scene.height());
        if (scene.aspect.get<CollisionObject>(scene.core)->velocity.y() > 0)
            highest = std::max(highest, scene.height());
    }
    EXPECT_GT(lowest, 0.5 - 0.05) << "not into the floor";
    EXPECT_NEAR(highest - 0.5, 0.25 * 2.5, 0.07) << "e² h";
}

TEST(Bounce, ComesToRestSleepsAndIsFoundTouching) {
    Bouncing scene(0.2);
    StepResult result;
    for (int frame = 0; frame < 400; ++frame) result = scene.frame();
    EXPECT_EQ(result.counters.freeBodies, 1u);
    EXPECT_EQ(result.counters.asleep, 1u);
    EXPECT_TRUE(result.accepted.empty()) << "a sleeper changes nothing";
    EXPECT_TRUE(result.velocities.empty());
    EXPECT_FALSE(result.contacts.empty());
    EXPECT_NEAR(scene.height(), 0.5, 0.02);
    const StepResult next = scene.frame();
    EXPECT_EQ(next.counters.pairsTested, 0u) << "nothing to ask about bodies at rest";
}

TEST(Bounce, ASleeperWakesWhenItsFloorIsTakenAway) {
    Bouncing scene(0.2);
    for (int frame = 0; frame < 400; ++frame) scene.frame();
    const double before = scene.height();
    scene.commit({.transform = scene.floor.transform, .translation = Vec3d(0, -30, 0)});
    for (int frame = 0; frame < 20; ++frame) scene.frame();
    EXPECT_LT(scene.height(), before - 0.2);
    // The same when it is deleted.
    Bouncing other(0.2);
    for (int frame = 0; frame < 400; ++frame) other.frame();
    other.set<Node>(other.floor.shape, fieldId<&Node::core>, ObjectId{});
    for (int frame = 0; frame < 20; ++frame) other.frame();
    EXPECT_LT(other.height(), before - 0.2);
}

TEST(Bounce, ASleeperWakesWhenItsFloorIsMaskedOut) {
    Bouncing scene(0.2);
    StepResult result;
    for (int frame = 0; frame < 400; ++frame) result = scene.frame();
    ASSERT_EQ(result.counters.asleep, 1u);
    const double before = scene.height();
    const ObjectId interest = scene.pipeline.interests().front().core;
    scene.set<Interest>(interest, fieldId<&Interest::againstLayers>, std::int64_t{2});
    for (int frame = 0; frame < 20; ++frame) scene.frame();
    EXPECT_LT(scene.height(), before - 0.2);
}

TEST(Bounce, ReportLetsItFallThrough) {
    Bouncing scene(0.5, Interest::kReport);
    for (int frame = 0; frame < 120; ++frame) scene.frame();
    EXPECT_LT(scene.height(), -5);
}

TEST(Bounce, AMotionPushesFreeBodiesAndStopsAtFixedOnes) {
    Bouncing scene(0.2);
    for (int frame = 0; frame < 300; ++frame) scene.frame();
    const auto pusher = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(-3, 0.6, 0));
    Interest fields;
    fields.object = pusher.node;
    fields.response = Interest::kBounce;
    scene.interest(fields);
    for (int frame = 0; frame < 120; ++frame) {
        const double x = scene.at(pusher.transform).translation.x();
        const StepResult result =
            scene.frame({{.transform = pusher.transform, .translation = Vec3d(x + 0.05, 0.6, 0)}});
        EXPECT_TRUE(result.stopped.empty());
    }
    const double ball = scene.at(scene.ball.transform).translation.x();
    EXPECT_GT(ball, 3.9) << "pushed ahead of it";
    const StepResult down = scene.frame({{.transform = pusher.transform, .translation = Vec3d(3, -2, 0)}});
    EXPECT_EQ(down.stopped.size(), 1u) << "the floor does not give way";
}

TEST(Bounce, AHandThatMovesAFreeBodyLetsItGoAtRest) {
    Bouncing scene(0.2);
    for (int frame = 0; frame < 20; ++frame) scene.frame();
    scene.frame({{.transform = scene.ball.transform, .translation = Vec3d(2, 6, 0), .source = 1}});
    EXPECT_EQ(scene.height(), 6);
    EXPECT_EQ(scene.aspect.get<CollisionObject>(scene.core)->velocity, Vec3d::Zero());
    scene.frame();
    EXPECT_LT(scene.height(), 6) << "and it falls from there";
    EXPECT_GT(scene.height(), 6 - 9.81 / 3600 - 1e-9);
}

}  // namespace
}  // namespace tessera
