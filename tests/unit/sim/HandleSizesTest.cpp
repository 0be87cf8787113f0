/// Handles of a size on the screen: what a camera makes of them, wherever heads and walls stand; who is told what, and
/// when.
#include "server/sim/view/HandleSizes.h"
#include "server/sim/view/LevelChoice.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/property/Seeds.h"
#include "tests/unit/manipulators/ManipulatorScene.h"
#include "tests/unit/sim/SceneForTests.h"

namespace tessera {
namespace {

/// How many pixels of a screen lie between two places of the world.
double pixelsBetween(const ScreenCamera& camera, const Vec3d& a, const Vec3d& b) {
    const auto onScreen = [&](const Vec3d& world) {
        const Vec4d clip = camera.clip_T_eye * (camera.eye_T_world * world).homogeneous();
        return Vec2d(0.5 * camera.pixels.width * clip.x() / clip.w(), 0.5 * camera.pixels.height * clip.y() / clip.w());
    };
    return (onScreen(a) - onScreen(b)).norm();
}

struct SizedHandles : ManipulatorScene {
    explicit SizedHandles(std::size_t users)
        : wall(test::wallOfUsers(users)), view{.users = wall.users}, sizes(wall, drags) {
        core = transform({});
        target = node(core);
        manipulate(Manipulator::kMove, target);
        setField<&Manipulator::pixels>(edit, manipulator, 80.0);
        apply();
        frame();
    }
    /// What a frame of the server does.
    bool choose() {
        ChangeList list = sizes.choose(scene, display, view);
        const bool said = !list.empty();
        if (said) apply(std::move(list));
        sizes.sceneChanged();
        frame();
        return said;
    }
    void put(const Vec3d& place) {
        setField<&Transform::translation>(edit, core, place);
        apply();
        sizes.sceneChanged();
    }
    [[nodiscard]] double sizeFor(std::size_t user) {
        const PlacedManipulator now = placed();
        return 2 * now.seenBy(user).frame.extent.x();
    }

    Wall wall;
    View view;
    HandleSizes sizes;
};

TEST(HandleSizes, AreAsManyPixelsAsWasSaidWhereverHeadsAndWallsStand) {
    forSeeds(200, [](std::mt19937_64& random) {
        SizedHandles bench(1 + random() % 10);
        for (int step = 0; step < 4; ++step) {
            bench.view.position = randomVector(random, 100);
            bench.view.orientation = randomRotation(random);
            bench.view.worldUnitsPerMetre = std::pow(10.0, uniform(random, -3, 3));
            for (User& user : bench.view.users)
                user.position = Vec3d(uniform(random, -0.9, 0.9), uniform(random, -0.9, 0.9), uniform(random, -1.9, 3));
            // Straight before one of them.
            const std::size_t who = random() % bench.view.users.size();
            const Vec3d head = bench.view.users[who].position;
            const double away = (head.z() + 2) * std::pow(10.0, uniform(random, -0.5, 2));
            const Affine3d world_T_wall = bench.view.world_T_wall();
            const Vec3d place = world_T_wall * Vec3d(head - Vec3d(0, 0, away));
            bench.put(place);
            bench.choose();
            EXPECT_FALSE(bench.choose()) << "nothing has moved";
            const Vec3d half = world_T_wall.linear().col(0).normalized() * 0.5 * bench.sizeFor(who);
            const ScreenCamera camera =
                screenCamera(bench.wall.screens[who], bench.view.users[who], Eye::kCenter, bench.view);
            const double seen = pixelsBetween(camera, place - half, place + half);
            if (who >= kLevelUsers || who + kLevelUsers < bench.view.users.size()) {
                EXPECT_LT(seen, 80 * 1.003) << "who shares a byte sees no larger ones";
            } else {
                EXPECT_NEAR(seen, 80, 80 * 0.003) << "half a step off at most";
            }
        }
    });
}

/// Whatever heads and things did before: sizes are those that somebody finds who has just come.
TEST(HandleSizes, DependOnNoHistory) {
    forSeeds(100, [](std::mt19937_64& random) {
        SizedHandles bench(1 + random() % 3);
        for (int step = 0; step < 20; ++step) {
            if (random() % 2 == 0) bench.put(randomVector(random, 10));
            if (random() % 2 == 0)
                bench.view.users[random() % bench.view.users.size()].position = randomVector(random, 1);
            if (random() % 2 == 0) bench.view.position = randomVector(random, 10);
            if (random() % 2 == 0) bench.choose();
        }
        bench.choose();
        const Manipulator followed = *bench.scene.get<Manipulator>(bench.manipulator);
        HandleSizes fresh(bench.wall, bench.drags);
        EXPECT_TRUE(fresh.choose(bench.scene, bench.display, bench.view).empty());
        EXPECT_GT(followed.sizes[static_cast<Eigen::Index>(bench.wall.users.size() - 1)], 0);
    });
}

/// Which handles a user sees follows from who they are, not from how far away they stand.
TEST(HandleSizes, AreNoLevelsThatAnybodyElseChooses) {
    SizedHandles bench(3);
    ASSERT_TRUE(bench.choose());
    ASSERT_EQ(bench.placed().sights(), 3u);
    LevelChoice levels(bench.wall);
    levels.update(bench.scene, nullptr);
    EXPECT_EQ(levels.count(), 0u);
    bench.put(Vec3d(0, 0, -7));
    EXPECT_TRUE(levels.choose(bench.scene, bench.view).empty());
}

TEST(HandleSizes, AreSaidWhereTheyAreWantedAndTakenBack) {
    SizedHandles bench(2);
    EXPECT_TRUE(bench.choose());
    EXPECT_EQ(bench.placed().sights(), 2u);
    // A head that trembles changes nothing: 6 m away, 0.1 mm.
    bench.put(Vec3d(0, 0, -6));
    (void)bench.choose();
    bench.view.users[0].position.x() = 1e-4;
    EXPECT_FALSE(bench.choose());
    bench.view.users[0].position.z() = 1;
    EXPECT_TRUE(bench.choose());
    EXPECT_NE(bench.sizeFor(0), bench.sizeFor(1));
    // What was not applied is said again.
    bench.view.users[0].position.z() = 2;
    EXPECT_FALSE(bench.sizes.choose(bench.scene, bench.display, bench.view).empty());
    EXPECT_FALSE(bench.sizes.choose(bench.scene, bench.display, bench.view).empty());
    setField<&Manipulator::pixels>(bench.edit, bench.manipulator, 0.0);
    bench.apply();
    bench.sizes.sceneChanged();
    EXPECT_TRUE(bench.choose());
    EXPECT_TRUE(bench.scene.get<Manipulator>(bench.manipulator)->sizes.isZero(0));
}

}  // namespace
}  // namespace tessera
