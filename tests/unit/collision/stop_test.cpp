#include <gtest/gtest.h>

#include <numbers>

#include "tests/unit/collision/SceneMaker.h"

namespace tessera {
namespace {

/// A unit box at the origin and a wall of 10 × 10 whose near face stands at x = 5.
struct BoxAndWall : SceneMaker {
    Body box = body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d::Zero());
    Body wall = body(kRootNode, shapes::box(Vec3d(0.2, 10, 10)), Vec3d(5.1, 0, 0));
    ObjectId wish = interest(box.node);

    TentativeTransform to(double x) { return {.transform = box.transform, .translation = Vec3d(x, 0, 0)}; }
    double x() { return at(box.transform).translation.x(); }
};

constexpr double kGap = 2e-4;  // stopTolerance times the box's diagonal, and a bit

TEST(Stop, ABoxComesToRestAtTheWall) {
    BoxAndWall scene;
    for (int frame = 0; frame < 100; ++frame) {
        const StepResult result = scene.frame({scene.to(scene.x() + 0.1)});
        EXPECT_LT(scene.x() + 0.5, 5.0);
        EXPECT_EQ(result.stopped.empty(), result.contacts.empty());
    }
    EXPECT_NEAR(scene.x() + 0.5, 5.0, kGap);
}

TEST(Stop, OneHugeStepDoesNotJumpTheWall) {
    BoxAndWall scene;
    const StepResult result = scene.frame({scene.to(1000)});
    EXPECT_EQ(result.stopped, std::vector{scene.box.transform});
    EXPECT_LT(scene.x() + 0.5, 5.0);
    EXPECT_NEAR(scene.x() + 0.5, 5.0, kGap);
}

TEST(Stop, ASmallSheetThatWouldEndUpInsideTheBoxStopsIt) {
    // No sampling of poses finds this one: before and after, no triangles meet.
    SceneMaker scene;
    const auto box = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d::Zero());
    scene.body(kRootNode, shapes::sheet(0.2, 0.2), Vec3d(2, 0, 0), Quatd(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3d::UnitY())));
    scene.interest(box.node);
    for (const double end : {2.0, 2.3, 500.0}) {
        scene.commit({.transform = box.transform});
        const StepResult result = scene.frame({{.transform = box.transform, .translation = Vec3d(end, 0, 0)}});
        EXPECT_EQ(result.stopped.size(), 1u);
        EXPECT_NEAR(scene.at(box.transform).translation.x(), 1.5, kGap);
        EXPECT_FALSE(result.contacts.empty());
    }
}

TEST(Stop, ReportsWhatStoppedItAndKeepsDoingSoWhilePressed) {
    BoxAndWall scene;
    scene.frame({scene.to(4)});
    for (int frame = 0; frame < 5; ++frame) {
        const StepResult result = scene.frame({scene.to(6)});
        ASSERT_FALSE(result.contacts.empty());
        EXPECT_EQ(result.contactsBegun, frame == 0 ? 1u : 0u);
        for (const Contact& c : result.contacts) {
            EXPECT_EQ(c.objectA, scene.box.shape);
            EXPECT_EQ(c.objectB, scene.wall.shape);
            EXPECT_NEAR(c.point.x(), 5.0, kGap);
            EXPECT_LE(std::abs(c.point.y()), 0.5 + kGap);
            EXPECT_LE(std::abs(c.point.z()), 0.5 + kGap);
            EXPECT_NEAR((c.normal - Vec3d::UnitX()).norm(), 0, 1e-9) << c.normal.transpose();
        }
    }
    const StepResult away = scene.frame({scene.to(3)});
    EXPECT_TRUE(away.stopped.empty());
    EXPECT_TRUE(away.contacts.empty());
    EXPECT_EQ(scene.x(), 3.0);
}

}  // namespace
}  // namespace tessera
