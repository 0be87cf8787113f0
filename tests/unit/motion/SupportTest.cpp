// Times of impact of bodies that rest on each other.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "server/collision/query/TimeOfImpact.h"
#include "tests/unit/motion/Bodies.h"

namespace tessera {
namespace {

/// A floor of 20 by 20 in y = 0 and a wall across it at x = 3, one mesh; a unit box stands on it at the origin.
struct BoxInHall {
    bodies::Body hall, box = bodies::box(Vec3d::Ones());
    std::vector<Support> supports{{.normal = Vec3d::UnitY(), .overlap = 1e-4, .rounding = 1e-10}};
    std::vector<FacePair> within;
    double sunk = 0;

    BoxInHall() {
        for (const double z : {-10.0, 10.0})
            for (const double x : {-10.0, 10.0}) hall.vertex(Vec3d(x, 0, z));
        for (const double z : {-10.0, 10.0})
            for (const double y : {0.0, 5.0}) hall.vertex(Vec3d(3, y, z));
        hall.indices = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6};
    }
    [[nodiscard]] Impact go(const Vec3d& by, const Quatd& turn = Quatd::Identity()) const {
        QueryWork work;
        const Vec3d from(0, 0.5 - sunk, 0);
        return timeOfImpact(hall.tree(), {}, box.tree(),
                            {{from, Quatd::Identity(), Vec3d::Ones()}, {from + by, turn, Vec3d::Ones()}}, work,
                            {.tolerance = 1e-9, .supports = supports, .within = within});
    }
};

TEST(Support, WithoutOneWhatTouchesIsMetAtOnce) {
    BoxInHall scene;
    scene.supports.clear();
    const Impact impact = scene.go(Vec3d(5, 0, 0));
    EXPECT_TRUE(impact.hit);
    EXPECT_EQ(impact.t, 0);
}

TEST(Support, WhatGoesAlongMeetsTheWallOfTheSameMesh) {
    const BoxInHall scene;
    const Impact impact = scene.go(Vec3d(5, 0, 1));
    EXPECT_TRUE(impact.hit);
    EXPECT_NEAR(impact.t, 0.5, 1e-8);
    EXPECT_LE(impact.t, 0.5);
    EXPECT_EQ(impact.support, -1);
    EXPECT_GE(impact.faces.a, 2u);
    EXPECT_NEAR(std::abs(impact.normal.x()), 1, 1e-9);
    EXPECT_FALSE(scene.go(Vec3d(-500, 0, 100)).hit);
    EXPECT_FALSE(scene.go(Vec3d(0, 20, 1)).hit);
}

TEST(Support, WhatIsPressedGetsNoDeeper) {
    BoxInHall scene;
    for (const double sunk : {0.0, 5e-5}) {
        scene.sunk = sunk;
        for (const double down : {1.0, 1e-3, 1e-8}) {
            const Impact impact = scene.go(Vec3d(2, -down, 0));
            EXPECT_TRUE(impact.hit);
            EXPECT_EQ(impact.t, 0) << down;
            EXPECT_EQ(impact.support, 0);
        }
        EXPECT_FALSE(scene.go(Vec3d(2, 0, 0)).hit) << sunk;
        EXPECT_FALSE(scene.go(Vec3d(2, 1, 0)).hit) << sunk;
    }
}

TEST(Support, HoldsWhatTurnsAboutItAndNotWhatTiltsIntoIt) {
    const BoxInHall scene;
    EXPECT_FALSE(scene.go(Vec3d(1, 0, 0), Quatd(Eigen::AngleAxisd(3, Vec3d::UnitY()))).hit);
    const Impact tilted = scene.go(Vec3d::Zero(), Quatd(Eigen::AngleAxisd(0.5, Vec3d::UnitZ())));
    EXPECT_TRUE(tilted.hit);
    EXPECT_LT(tilted.t, 1e-4);
    // Upwards fast enough that the lowest corner rises: 0.5 (cos a + sin a) at most.
    EXPECT_FALSE(scene.go(Vec3d(0, 0.5, 0), Quatd(Eigen::AngleAxisd(0.5, Vec3d::UnitZ()))).hit);
}

TEST(Support, WhatIsLeftOutIsNotMet) {
    BoxInHall scene;
    for (std::uint32_t wall = 2; wall < 4; ++wall)
        for (std::uint32_t face = 0; face < 12; ++face) scene.within.push_back({wall, face});
    EXPECT_FALSE(scene.go(Vec3d(5, 0, 1)).hit);
}

TEST(Support, OfThePartingKindHoldsWhatComesOut) {
    BoxInHall scene;
    scene.sunk = 0.3;
    scene.supports = {{.normal = Vec3d::UnitY(), .overlap = 0.31, .rounding = 1e-10, .parting = true}};
    EXPECT_FALSE(scene.go(Vec3d(1, 2, 0)).hit);
    EXPECT_TRUE(scene.go(Vec3d(1, 0.1, 0)).hit);
}

/// The wall overlaps by more than the box is sunk.
TEST(Support, OfThePartingKindHoldsNoWall) {
    BoxInHall scene;
    scene.sunk = 0.3;
    scene.supports = {{.normal = Vec3d::UnitY(), .overlap = 0.31, .rounding = 1e-10, .parting = true}};
    const Impact impact = scene.go(Vec3d(3, 3, 0));
    EXPECT_TRUE(impact.hit);
    EXPECT_NEAR(impact.t, 2.5 / 3, 1e-8);
    EXPECT_GE(impact.faces.a, 2u);
}

}  // namespace
}  // namespace tessera
