/// The culler `auto`: looks for what is hidden where that pays, rarely where it does not.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/geometry/TriangleOrder.h"
#include "tests/unit/render/TestScene.h"

namespace tessera {
namespace {

/// Frames of `count` in which it looked.
int looksOf(RenderAction& action, const TestScene& scene, int count) {
    RenderScene all;
    all.update(scene.aspect, nullptr);
    int looks = 0;
    for (int frame = 0; frame < count; ++frame) {
        CullCounts counts;
        (void)action.run(all, TestCamera().camera(), TestCamera().tile(), &counts);
        looks += counts.looked;
    }
    return looks;
}

/// Many small things; a wall before them hides all.
void fill(TestScene& scene, bool wall) {
    for (int x = -10; x <= 10; ++x)
        for (int y = -10; y <= 10; ++y) scene.box({0.5 * x, 0.5 * y, -20}, {0.1, 0.1, 0.1});
    if (wall) scene.box({0, 0, -8}, {30, 30, 0.1});
}

TEST(AutoCuller, LooksInEachFrameWhereThatPays) {
    TestScene scene;
    fill(scene, true);
    scene.apply();
    RenderAction action(CullerKind::kAuto);
    EXPECT_EQ(looksOf(action, scene, 300), 300);
}

TEST(AutoCuller, LooksRarelyWhereNothingIsHiddenAndAtOnceWhereMuchHasCome) {
    TestScene field;
    fill(field, false);
    field.apply();
    RenderAction action(CullerKind::kAuto);
    // Three, then pauses of 0, 1, 3, 7, … 127 frames.
    EXPECT_LE(looksOf(action, field, 1000), 18);
    TestScene larger;
    fill(larger, true);
    for (int i = 0; i < 600; ++i) larger.box({0.01 * i - 3, 0, -21}, {0.1, 0.1, 0.1});
    larger.apply();
    EXPECT_EQ(looksOf(action, larger, 50), 50);
}

TEST(AutoCuller, OneThingAloneIsNotLookedBehind) {
    TestScene scene;
    scene.put(scene.geometry(makeSphere(1, 100)), {0, 0, -4});
    scene.apply();
    RenderAction action(CullerKind::kAuto);
    EXPECT_LE(looksOf(action, scene, 500), 15);
}

// What is behind a closed mesh's front is its own back, which drawing leaves away by itself.
TEST(AutoCuller, OneLargeClosedMeshCloseUpIsNotLookedBehind) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> u(-1, 1);
    for (int round = 0; round < 12; ++round) {
        TestScene scene;
        MeshData mesh = makeSphere(1, 120 + 60 * (round % 4));
        for (std::size_t k = 0; k < mesh.positions.size(); k += 3) {
            const auto scale = static_cast<float>(1 + 0.05 * std::sin(7 * mesh.positions[k]) + 0.0005 * u(random));
            for (std::size_t axis = 0; axis < 3; ++axis) mesh.positions[k + axis] *= scale;
        }
        mesh.indices = inSpatialOrder(mesh.positions, mesh.indices);
        scene.put(scene.geometry(mesh), {0.3 * u(random), 0.3 * u(random), -1.8 - std::abs(u(random))},
                  Quatd(u(random), u(random), u(random), u(random)).normalized());
        scene.apply();
        RenderAction action(CullerKind::kAuto);
        EXPECT_LE(looksOf(action, scene, 300), 12) << "round " << round;
    }
}

}  // namespace
}  // namespace tessera
