#include "client/render/TileProjection.h"

#include <random>

#include "tests/unit/render/TestScene.h"

namespace tessera {
namespace {

/// A tile that lies across the middle of its screen.
struct Place {
    TestCamera wall{160, 120, 2, 1};
    ScreenCamera camera = wall.camera();
    PixelRect rect{100, 20, 160, 96};
    TileProjection tile{camera, rect};
};

Vec2d pixelOf(const Place& place, const Vec3d& p) {
    const Vec4d c = place.tile.clip_T_world() * p.homogeneous();
    return {place.tile.xPx(c.x(), c.w()), place.tile.yPx(c.y(), c.w())};
}

TEST(TileProjection, CountsPixelsFromTheTilesLowerLeft) {
    const Place place;
    // The screen's middle is pixel (160, 60) of the screen.
    EXPECT_TRUE(pixelOf(place, {0, 0, -7}).isApprox(Vec2d(60, 40), 1e-9));
    EXPECT_TRUE(place.tile.usable());
    EXPECT_NEAR(place.tile.nearMetres(), 0.05, 1e-9);
    EXPECT_EQ(place.tile.farMetres(), std::numeric_limits<double>::infinity());
}

TEST(TileProjection, AProjectionThatIsNoPerspectiveIsNotUsed) {
    Place place;
    place.camera.clip_T_eye.row(3) = Eigen::RowVector4d(0, 0, 0, 1);
    EXPECT_FALSE(TileProjection(place.camera, place.rect).usable());
}

TEST(TileProjection, AFootprintHoldsEveryPointOfItsBox) {
    const Place place;
    std::mt19937 random(2);
    std::uniform_real_distribution<double> at(-3, 3), size(0.01, 2), unit(0, 1);
    int near = 0;
    for (int round = 0; round < 500; ++round) {
        Box box;
        const Vec3d center(at(random), at(random), at(random) - 2.5);
        const Vec3d half(size(random), size(random), size(random));
        box.lower = center - half;
        box.upper = center + half;
        const Footprint footprint = place.tile.footprint(place.tile.clip_T_world(), box, 0);
        near += footprint.nearPlane;
        for (int i = 0; i < 50; ++i) {
            const Vec3d p = box.lower + Vec3d(unit(random), unit(random), unit(random)).cwiseProduct(box.size());
            // Eye at the origin, looking along -z.
            if (-p.z() < 0.1) continue;
            const Vec2d pixel = pixelOf(place, p);
            EXPECT_TRUE(footprint.lowerX <= pixel.x() && pixel.x() <= footprint.upperX);
            EXPECT_TRUE(footprint.lowerY <= pixel.y() && pixel.y() <= footprint.upperY);
            EXPECT_GE(footprint.nearest, 1 / -p.z());
            EXPECT_GE(footprint.farthest, -p.z());
        }
    }
    EXPECT_GT(near, 50);
    EXPECT_LT(near, 450);
}

TEST(TileProjection, CoveredPixelsAreThoseOfTheBoxesOutlineWithinTheTile) {
    const Place place;
    const auto covered = [&](const Vec3d& lower, const Vec3d& upper) {
        Box box;
        box.lower = lower;
        box.upper = upper;
        return place.tile.coveredPx(place.tile.clip_T_world(), box);
    };
    // A metre at 4 m distance is 80 px: 320 px for 2 m at 2 m.
    EXPECT_NEAR(covered({-0.1, -0.1, -5}, {0.1, 0.1, -4}), 16.0 * 16.0, 1e-6);
    EXPECT_NEAR(covered({-9, -9, -5}, {9, 9, -4}), 160.0 * 96.0, 1e-6);
    EXPECT_NEAR(covered({-9, -0.1, -5}, {9, 0.1, -4}), 160.0 * 16.0, 1e-6);
    EXPECT_EQ(covered({40, 0, -5}, {41, 1, -4}), 0);
    EXPECT_EQ(covered({-1, -1, 1}, {1, 1, 3}), 0);
    // Around the eye: all of the tile. From behind the eye along the left: the left of the tile.
    EXPECT_NEAR(covered({-1, -1, -1}, {1, 1, 1}), 160.0 * 96.0, 1e-6);
    EXPECT_NEAR(covered({-2, -900, -1000}, {-1, 900, 5}), (60.0 - 320.0 / 1000) * 96, 5);
}

}  // namespace
}  // namespace tessera
