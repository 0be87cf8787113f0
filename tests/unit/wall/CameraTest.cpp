#include <gtest/gtest.h>

#include <cstring>
#include <random>

#include "common/wall/View.h"
#include "tests/unit/wall/SampleWalls.h"

namespace tessera {
namespace {

using test::caveWall;
using test::flatWall;

View viewOf(const Wall& wall) {
    View view;
    view.position = {3, -2, 5};
    view.orientation = Quatd(Eigen::AngleAxisd(0.7, Vec3d(1, 2, -0.5).normalized()));
    view.worldUnitsPerMetre = 2.5;
    view.users = wall.users;
    return view;
}

/// Where a point of the wall's frame lands in the picture, in pixels from the lower left; z is depth in clip space.
Vec3d pixelOf(const ScreenCamera& camera, const View& view, const Vec3d& inWall) {
    const Vec3d world = view.world_T_wall() * inWall;
    const Vec3d eye = camera.eye_T_world * world;
    const Vec4d clip = camera.clip_T_eye * eye.homogeneous();
    return {(clip.x() / clip.w() + 1) * 0.5 * camera.pixels.width,
            (clip.y() / clip.w() + 1) * 0.5 * camera.pixels.height, clip.z() / clip.w()};
}

bool sameBits(const ScreenCamera& a, const ScreenCamera& b) {
    return std::memcmp(a.clip_T_eye.data(), b.clip_T_eye.data(), sizeof(double) * 16) == 0 &&
           std::memcmp(a.eye_T_world.matrix().data(), b.eye_T_world.matrix().data(), sizeof(double) * 16) == 0 &&
           std::memcmp(a.eyeWorld.data(), b.eyeWorld.data(), sizeof(double) * 3) == 0 &&
           a.pixels.width == b.pixels.width && a.pixels.height == b.pixels.height;
}

TEST(ScreenCamera, PutsTheScreensCornersInThePicturesCorners) {
    for (const Wall& wall : {flatWall(2, 2), caveWall()}) {
        const View view = viewOf(wall);
        for (const Screen& screen : wall.screens) {
            const ScreenCamera camera = screenCamera(screen, wall.users[0], Eye::kCenter, view);
            const double w = camera.pixels.width, h = camera.pixels.height;
            EXPECT_LT((pixelOf(camera, view, screen.lowerLeft).head<2>() - Vec2d(0, 0)).norm(), 1e-8) << screen.name;
            EXPECT_LT((pixelOf(camera, view, screen.lowerRight).head<2>() - Vec2d(w, 0)).norm(), 1e-8) << screen.name;
            EXPECT_LT((pixelOf(camera, view, screen.upperLeft).head<2>() - Vec2d(0, h)).norm(), 1e-8) << screen.name;
        }
    }
}

TEST(ScreenCamera, ShowsWhatLiesBehindTheScreenOnTheLineFromTheEye) {
    const Wall wall = flatWall(1, 1);
    const View view = viewOf(wall);
    const ScreenCamera camera = screenCamera(wall.screens[0], wall.users[0], Eye::kCenter, view);
    const Vec3d onScreen(0.4, 1.1, 0);
    const Vec3d eye = wall.users[0].position;
    const Vec3d behind = eye + 3.7 * (onScreen - eye);
    EXPECT_LT((pixelOf(camera, view, onScreen) - pixelOf(camera, view, behind)).head<2>().norm(), 1e-8);
    EXPECT_LT(pixelOf(camera, view, onScreen).z(), pixelOf(camera, view, behind).z())
        << "nearer things have smaller depth";
    EXPECT_GT((pixelOf(camera, view, onScreen) - pixelOf(camera, view, onScreen + Vec3d(0, 0, -1))).head<2>().norm(),
              10)
        << "the user stands off the screen's axis: depth shifts the picture";
}

TEST(ScreenCamera, MeasuresDepthInMetresFromTheEye) {
    const Wall wall = flatWall(1, 1);
    const View view = viewOf(wall);
    const ScreenCamera camera = screenCamera(wall.screens[0], wall.users[0], Eye::kCenter, view, 0.1);
    const Vec3d eye = wall.users[0].position;
    EXPECT_NEAR(pixelOf(camera, view, eye - Vec3d(0, 0, 0.1)).z(), -1, 1e-9);
    EXPECT_NEAR(pixelOf(camera, view, eye - Vec3d(0, 0, 0.2)).z(), 0, 1e-9);
    EXPECT_NEAR(pixelOf(camera, view, eye - Vec3d(0, 0, 1e12)).z(), 1, 1e-9) << "there is no end";
    EXPECT_LT((camera.eye_T_world * camera.eyeWorld).norm(), 1e-12);
    EXPECT_NEAR((camera.eye_T_world * (view.world_T_wall() * Vec3d(eye - Vec3d(0, 0, 7)))).z(), -7, 1e-9);
}

TEST(ScreenCamera, SeesHoweverFar) {
    const Wall wall = flatWall(1, 1);
    const View view = viewOf(wall);
    const ScreenCamera camera = tileCamera(wall, layoutTiles(wall)[0], view);
    const Frustum frustum = tileFrustum(camera, layoutTiles(wall)[0].rect);
    for (const double away : {500.0, 1500.0, 1e6, 1e15}) {
        const Vec3d at = view.world_T_wall() * Vec3d(wall.users[0].position - Vec3d(0, 0, away));
        EXPECT_FALSE(frustum.classify({at - Vec3d::Ones(), at + Vec3d::Ones()}).outside) << away;
        EXPECT_LT(pixelOf(camera, view, wall.users[0].position - Vec3d(0, 0, away)).z(), 1.0 + 1e-12) << away;
    }
}

TEST(ScreenCamera, SeesAsNearAsTheWallSays) {
    Wall wall = flatWall(1, 1);
    wall.nearMetres = 0.2;
    const View view = viewOf(wall);
    EXPECT_NEAR(
        pixelOf(tileCamera(wall, layoutTiles(wall)[0], view), view, wall.users[0].position - Vec3d(0, 0, 0.2)).z(), -1,
        1e-9);
}

TEST(ScreenCamera, IsTheSameInEveryBitHoweverTheScreenIsCutIntoTiles) {
    const Wall one = flatWall(1, 1);
    const View view = viewOf(one);
    for (const Wall& wall : {flatWall(2, 2), flatWall(3, 1), flatWall(4, 3)}) {
        EXPECT_TRUE(sameBits(screenCamera(one.screens[0], one.users[0], Eye::kCenter, view),
                             screenCamera(wall.screens[0], wall.users[0], Eye::kCenter, view)));
    }
    for (const auto& [width, height] : {std::pair{1001, 333}, std::pair{641, 479}}) {
        const Wall big = *withSize(one, width, height);
        const Wall cut = *withSize(flatWall(3, 2), width, height);
        for (const Tile& tile : layoutTiles(cut)) {
            EXPECT_TRUE(sameBits(tileCamera(big, layoutTiles(big)[0], view), tileCamera(cut, tile, view)));
        }
    }
}

TEST(ScreenCamera, PicturesOfScreensThatMeetAgreeOnTheirCommonEdge) {
    const Wall wall = caveWall();
    const View view = viewOf(wall);
    const auto camera = [&](std::size_t screen) {
        return screenCamera(wall.screens[screen], wall.users[0], Eye::kCenter, view);
    };
    const ScreenCamera front = camera(0), left = camera(1), right = camera(2), floor = camera(3);
    const Vec3d eye = wall.users[0].position;
    for (const double along : {0.1, 0.37, 0.5, 0.93}) {
        for (const double depth : {0.6, 1.0, 2.5}) {  // in front of, on and behind the edge
            const auto seenAt = [&](const Vec3d& onEdge) { return Vec3d(eye + depth * (onEdge - eye)); };
            const Vec3d leftEdge = seenAt({-1.2, 2.4 * along, 0});
            EXPECT_NEAR(pixelOf(front, view, leftEdge).x(), 0, 1e-7);
            EXPECT_NEAR(pixelOf(left, view, leftEdge).x(), 800, 1e-7);
            EXPECT_NEAR(pixelOf(front, view, leftEdge).y(), pixelOf(left, view, leftEdge).y(), 1e-7);
            const Vec3d rightEdge = seenAt({1.2, 2.4 * along, 0});
            EXPECT_NEAR(pixelOf(front, view, rightEdge).x(), 800, 1e-7);
            EXPECT_NEAR(pixelOf(right, view, rightEdge).x(), 0, 1e-7);
            EXPECT_NEAR(pixelOf(front, view, rightEdge).y(), pixelOf(right, view, rightEdge).y(), 1e-7);
            const Vec3d floorEdge = seenAt({-1.2 + 2.4 * along, 0, 0});
            EXPECT_NEAR(pixelOf(front, view, floorEdge).y(), 0, 1e-7);
            EXPECT_NEAR(pixelOf(floor, view, floorEdge).y(), 800, 1e-7);
            EXPECT_NEAR(pixelOf(front, view, floorEdge).x(), pixelOf(floor, view, floorEdge).x(), 1e-7);
        }
    }
}

TEST(ScreenCamera, SeparatesTheEyesAlongTheHeadsOwnRightAxis) {
    User user;
    user.eyeSeparationMetres = 0.06;
    EXPECT_LT((user.eye(Eye::kRight) - user.eye(Eye::kLeft) - Vec3d(0.06, 0, 0)).norm(), 1e-15);
    EXPECT_LT((user.eye(Eye::kCenter) - user.position).norm(), 1e-15);
    user.orientation = Quatd(Eigen::AngleAxisd(std::acos(-1.0) / 2, Vec3d::UnitY()));  // looks to the left: right is -Z
    EXPECT_LT((user.eye(Eye::kRight) - user.position - Vec3d(0, 0, -0.03)).norm(), 1e-15);
    user.orientation.coeffs() *= 3;  // a file's quaternion need not be normalised
    EXPECT_LT((user.eye(Eye::kRight) - user.position - Vec3d(0, 0, -0.03)).norm(), 1e-15);
}

TEST(ScreenCamera, ShiftsNearThingsToTheRightForTheLeftEye) {
    const Wall wall = flatWall(1, 1);
    const View view = viewOf(wall);
    const Vec3d inFront(0, 1.5, 1.0);
    const double left = pixelOf(screenCamera(wall.screens[0], wall.users[0], Eye::kLeft, view), view, inFront).x();
    const double center = pixelOf(screenCamera(wall.screens[0], wall.users[0], Eye::kCenter, view), view, inFront).x();
    const double right = pixelOf(screenCamera(wall.screens[0], wall.users[0], Eye::kRight, view), view, inFront).x();
    EXPECT_GT(left, center);
    EXPECT_GT(center, right);
}

TEST(ScreenCamera, HoldsAHeadThatWalksIntoTheWallInFrontOfIt) {
    const Wall wall = flatWall(1, 1);
    View view = viewOf(wall);
    for (const double z : {0.0, -3.0, 0.001}) {
        view.users[0].position.z() = z;
        const ScreenCamera camera = screenCamera(wall.screens[0], view.users[0], Eye::kCenter, view);
        EXPECT_TRUE(camera.clip_T_eye.allFinite());
        EXPECT_GT(camera.clip_T_eye(0, 0), 0);
    }
}

TEST(TileFrustum, HoldsExactlyWhatFallsIntoTheTilesPixels) {
    const Wall wall = flatWall(3, 2, 1920, 1080);
    const View view = viewOf(wall);
    const ScreenCamera camera = screenCamera(wall.screens[0], wall.users[0], Eye::kCenter, view);
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> x(-4, 4), y(-2, 5), z(-8, 2.2);
    int inside = 0;
    for (int i = 0; i < 4000; ++i) {
        const Vec3d point(x(random), y(random), z(random));
        const Vec3d pixel = pixelOf(camera, view, point);
        const Vec3d world = view.world_T_wall() * point;
        Box box;
        box.extend(world);
        int holders = 0;
        for (const Tile& tile : layoutTiles(wall)) {
            const bool in = !tileFrustum(camera, tile.rect, 0).classify(box).outside;
            const bool expected = pixel.x() >= tile.rect.x && pixel.x() <= tile.rect.x + tile.rect.width &&
                                  pixel.y() >= tile.rect.y && pixel.y() <= tile.rect.y + tile.rect.height &&
                                  std::abs(pixel.z()) <= 1;
            EXPECT_EQ(in, expected) << tile.name << " pixel " << pixel.transpose();
            holders += in;
        }
        const PixelRect whole{.x = 0, .y = 0, .width = 1920, .height = 1080};
        EXPECT_EQ(holders > 0, !tileFrustum(camera, whole, 0).classify(box).outside)
            << "the tiles together are the screen";
        inside += holders > 0;
    }
    EXPECT_GT(inside, 500);
    EXPECT_LT(inside, 3500);
}

TEST(TileFrustum, GrowsByItsMargin) {
    const Wall wall = flatWall(2, 2);
    const View view = viewOf(wall);
    const ScreenCamera camera = screenCamera(wall.screens[0], wall.users[0], Eye::kCenter, view);
    const PixelRect lowerLeft = layoutTiles(wall)[0].rect;
    const auto holds = [&](double xPx, double marginPx) {
        const Vec3d onScreen = wall.screens[0].lowerLeft + Vec3d(3.2 * xPx / 1920, 0.9, 0);
        Box box;
        box.extend(Vec3d(view.world_T_wall() * onScreen));
        return !tileFrustum(camera, lowerLeft, marginPx).classify(box).outside;
    };
    EXPECT_TRUE(holds(959.9, 0));
    EXPECT_FALSE(holds(960.5, 0));
    EXPECT_TRUE(holds(960.5, 1));
    EXPECT_FALSE(holds(961.5, 1));
    EXPECT_TRUE(holds(961.5, 2));
}

TEST(PickRay, PassesThroughThePixelItIsAskedFor) {
    Wall wall = flatWall(3, 2, 1920, 1080);
    wall.screens[0].grid.bezelXPx = 40;
    wall.screens[0].grid.bezelYPx = 30;
    const View view = viewOf(wall);
    const ScreenCamera camera = screenCamera(wall.screens[0], wall.users[0], Eye::kCenter, view);
    const Affine3d wall_T_world = view.world_T_wall().inverse();
    const auto pictureAt = [&](double xPx, double yPx) {
        const Expected<Ray> ray = pickRay(wall, view, xPx, yPx);
        EXPECT_TRUE(ray);
        EXPECT_LT((ray->origin - camera.eyeWorld).norm(), 1e-12);
        EXPECT_NEAR(ray->direction.norm(), 1, 1e-12);
        return Vec2d(pixelOf(camera, view, wall_T_world * Vec3d(ray->origin + 9 * ray->direction)).head<2>());
    };
    // The mosaic leaves out the hidden pixels and counts rows from the top.
    EXPECT_LT((pictureAt(0, 0) - Vec2d(0.5, 1110 - 0.5)).norm(), 1e-7);
    EXPECT_LT((pictureAt(1919, 1079) - Vec2d(1920 + 80 - 0.5, 0.5)).norm(), 1e-7);
    EXPECT_LT((pictureAt(640, 540) - Vec2d(680.5, 539.5)).norm(), 1e-7);
    EXPECT_LT((pictureAt(639, 539) - Vec2d(639.5, 570.5)).norm(), 1e-7);
}

TEST(PickRay, RefusesPixelsThatNoTileShows) {
    const Wall wall = flatWall(2, 2);
    const View view = viewOf(wall);
    for (const auto& [x, y] : {std::pair{-1.0, 5.0}, {5.0, -0.5}, {1920.0, 5.0}, {5.0, 1080.0}, {std::nan(""), 5.0}}) {
        EXPECT_FALSE(pickRay(wall, view, x, y)) << x << " " << y;
    }
}

TEST(DefaultView, FillsTheFirstScreenWithTheScenesSphere) {
    for (const Wall& wall : {flatWall(2, 2), caveWall(), flatWall(1, 1, 300, 900)}) {
        Box bounds;
        bounds.extend(Vec3d(100, 20, -40));
        bounds.extend(Vec3d(180, 60, 30));
        const View view = defaultView(wall, bounds);
        const double radius = 0.5 * bounds.size().norm();
        const ScreenCamera camera = screenCamera(wall.screens[0], wall.users[0], Eye::kCenter, view);
        const PixelRect whole{.x = 0, .y = 0, .width = camera.pixels.width, .height = camera.pixels.height};
        double nearest = 1e300;
        const Frustum frustum = tileFrustum(camera, whole, 0);
        for (int side = 0; side < 4; ++side) {
            const Plane& plane = frustum.planes()[static_cast<std::size_t>(side)];
            nearest = std::min(nearest, plane.normal.dot(bounds.center()) + plane.offset);
        }
        EXPECT_NEAR(nearest / radius, 1, 1e-9) << "touches the nearest edge from inside";
        const Vec3d towards = (camera.eyeWorld - bounds.center()).normalized();
        EXPECT_GT(towards.y(), 0.2) << "from above";
        EXPECT_GT(towards.x(), 0.2) << "not from the front alone";
        EXPECT_GT(towards.z(), 0.2);
        EXPECT_NEAR((view.orientation * Vec3d::UnitX()).y(), 0, 1e-12) << "the horizon is level";
        EXPECT_TRUE(uprightView(wall, bounds).orientation.isApprox(Quatd::Identity()));
        EXPECT_EQ(uprightView(wall, bounds).worldUnitsPerMetre, view.worldUnitsPerMetre);
        EXPECT_GT((camera.eyeWorld - bounds.center()).norm(), radius) << "the user is outside";
        EXPECT_EQ(view.users.size(), wall.users.size());
        EXPECT_TRUE(checkStand(view));
    }
}

TEST(StudioView, FillsThreeQuartersOfTheFirstScreenWithTheModel) {
    const auto ball = [](const Vec3d& middle, const Vec3d& half) {
        std::vector<Vec3d> points;
        for (double u = 0; u < 3.14; u += 0.1)
            for (double v = 0; v < 6.28; v += 0.1)
                points.emplace_back(middle + half.cwiseProduct(Vec3d(std::sin(u) * std::cos(v), std::cos(u),
                                                                     std::sin(u) * std::sin(v))));
        return points;
    };
    // A ball, a plate that lies, one that stands, a rod, and something small far away.
    const std::pair<Vec3d, Vec3d> models[] = {{{0, 0, 0}, {1, 1, 1}},       {{5, 5, 5}, {3, 0, 2}},
                                              {{5, 5, 5}, {0, 3, 2}},       {{-9, 0, 1}, {0.1, 40, 0.1}},
                                              {{-9, 0, 1}, {0.1, 0.1, 40}}, {{4e6, 5e6, 300}, {0.01, 0.02, 0.01}}};
    for (const Wall& wall : {flatWall(2, 2), caveWall(), flatWall(1, 1, 300, 900)})
        for (const auto& [middle, half] : models) {
            const std::vector<Vec3d> points = ball(middle, half);
            Box bounds;
            for (const Vec3d& point : points) bounds.extend(point);
            const View view = studioView(wall, bounds, points);
            const ScreenCamera camera = screenCamera(wall.screens[0], wall.users[0], Eye::kCenter, view);
            const Vec2d size(camera.pixels.width, camera.pixels.height);
            Vec2d lower = size, upper = Vec2d::Zero();
            for (const Vec3d& point : points) {
                const Vec2d at = pixelOf(camera, view, view.world_T_wall().inverse() * point).head<2>();
                lower = lower.cwiseMin(at);
                upper = upper.cwiseMax(at);
            }
            const Vec2d filled = (upper - lower).cwiseQuotient(size);
            // A fifth of the way to the screen is as near as anything comes.
            EXPECT_NEAR(filled.maxCoeff(), 0.75, half.z() == 40 ? 0.2 : 0.01) << wall.name << " " << half.transpose();
            EXPECT_LT((0.5 * (lower + upper) - 0.5 * size).norm(), 0.01 * size.norm()) << "in the middle";
            EXPECT_TRUE(view.orientation.isApprox(defaultView(wall, bounds).orientation));
        }
    // Without a model: as a scene.
    Box bounds;
    bounds.extend(Vec3d(-1, -1, -1));
    bounds.extend(Vec3d(1, 1, 1));
    EXPECT_EQ(studioView(flatWall(2, 2), bounds, {}).position, defaultView(flatWall(2, 2), bounds).position);
    EXPECT_EQ(studioView(flatWall(2, 2), Box(), {}).worldUnitsPerMetre, 1);
}

TEST(DefaultView, IsTheIdentityForAnEmptyScene) {
    const View view = defaultView(flatWall(2, 2), Box());
    EXPECT_EQ(view.worldUnitsPerMetre, 1);
    EXPECT_EQ(view.position, Vec3d::Zero().eval());
    EXPECT_EQ(view.users.size(), 1u);
}

TEST(DefaultView, LooksAtASinglePointWithoutZoomingIntoIt) {
    Box point;
    point.extend(Vec3d(5, 6, 7));
    const Wall wall = flatWall(1, 1);
    const View view = defaultView(wall, point);
    EXPECT_EQ(view.worldUnitsPerMetre, 1);
    EXPECT_LT((pixelOf(screenCamera(wall.screens[0], wall.users[0], Eye::kCenter, view), view,
                       view.world_T_wall().inverse() * Vec3d(5, 6, 7))
                   .head<2>() -
               Vec2d(960, 540))
                  .norm(),
              1e-7);
}

TEST(CheckStand, RefusesWhereNoWallCanBe) {
    const Wall wall = flatWall(2, 2);
    const auto refused = [&](auto change) {
        View view = viewOf(wall);
        change(view);
        const Expected<void> result = checkStand(view);
        return result ? std::string() : result.error().message;
    };
    EXPECT_EQ(refused([](View&) {}), "");
    EXPECT_NE(refused([](View& v) { v.position.x() = std::nan(""); }), "");
    EXPECT_NE(refused([](View& v) { v.orientation.coeffs().setZero(); }), "");
    EXPECT_NE(refused([](View& v) { v.worldUnitsPerMetre = 0; }), "");
    EXPECT_NE(refused([](View& v) { v.worldUnitsPerMetre = -1; }), "");
    EXPECT_NE(refused([](View& v) { v.position.y() = 2 * kMaxViewCoordinate; }), "");
}

}  // namespace
}  // namespace tessera
