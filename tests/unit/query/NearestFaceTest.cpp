#include "server/collision/query/NearestFace.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/unit/motion/Bodies.h"
#include "tests/unit/query/NearestOracle.h"

namespace tessera {
namespace {

using bodies::Body;

constexpr VolumeKind kEveryKind[] = {VolumeKind::kSphere, VolumeKind::kAabb,  VolumeKind::kObb,  VolumeKind::kDop6,
                                     VolumeKind::kDop14,  VolumeKind::kDop18, VolumeKind::kDop26};

/// Maps from gentle to flat, and to where the world ends.
std::vector<Affine3d> mapsFor(std::mt19937& random) {
    std::uniform_real_distribution<double> u(-1, 1);
    const auto turn = [&] { return Quatd(u(random), u(random), u(random), u(random)).normalized(); };
    const auto made = [&](const Vec3d& scale, double far) {
        return Affine3d(Eigen::Translation3d(far * Vec3d(u(random), u(random), u(random))) * turn() *
                        Eigen::Scaling(scale) * turn());
    };
    return {Affine3d::Identity(),
            made(Vec3d::Constant(3), 5),
            made({1, -2, 0.01}, 2),
            made({1, 1e-7, 1e4}, 2),
            made({1, 1, 0}, 1),
            made({0, 2, 0}, 1),
            made({0, 0, 0}, 1),
            made(Vec3d::Constant(1e-20), 1e-19),
            made(Vec3d::Constant(1e20), 1e20),
            made(Vec3d::Ones(), 1e9)};
}

/// Of places near, within and far away.
void compare(const Body& body, const TriangleTree& tree, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> u(-1, 1);
    const TriangleMesh mesh = body.mesh();
    for (std::size_t which = 0; const Affine3d& map : mapsFor(random)) {
        SCOPED_TRACE(testing::Message() << "map " << which++ << ", volumes " << int(tree.options().volume));
        const double size = std::max(map.linear().norm() * mesh.bounds().size().norm(), 1e-300);
        const Vec3d centre = map * mesh.bounds().center();
        for (int i = 0; i < 12; ++i) {
            const double from = i % 3 == 0 ? 0.4 : i % 3 == 1 ? 2 : 1e7;
            const Vec3d place = centre + from * size * Vec3d(u(random), u(random), u(random));
            long double truth = std::numeric_limits<long double>::infinity();
            for (std::uint32_t face = 0; face < mesh.faceCount(); ++face)
                truth = std::min(truth, nearest::distanceTo(transformed(map, mesh.triangle(face)), place));
            QueryWork work;
            const std::optional<NearestFace> found = nearestFace(tree, map, place, work);
            ASSERT_TRUE(found) << "seed " << seed << ", place " << i;
            const double rounding = 1e-14 * (centre.norm() + size + place.norm());
            ASSERT_NEAR(found->distance, double(truth), rounding) << "seed " << seed << ", place " << i;
            const Triangle face = transformed(map, mesh.triangle(found->face));
            EXPECT_LE(double(nearest::distanceTo(face, place)), double(truth) + rounding);
            EXPECT_LE(double(nearest::distanceTo(face, found->point)), 2 * rounding) << "it lies on its face";
            EXPECT_NEAR((found->point - place).norm(), found->distance, rounding);
        }
    }
}

TEST(NearestFace, IsWhatBruteForceFindsInEveryKindOfTreeUnderEveryMap) {
    std::mt19937 random(3);
    const Body soup = bodies::soup(random, 200), ball = bodies::sphere(1, 12, 16);
    for (const Body* body : {&soup, &ball})
        for (const VolumeKind kind : kEveryKind)
            compare(*body, TriangleTree(body->mesh(), {.volume = kind}), 21 + static_cast<unsigned>(kind));
}

TEST(NearestFace, ThinTrianglesAndThoseWithoutAreaAreWhatTheyAre) {
    std::mt19937 random(8);
    std::uniform_real_distribution<double> u(-1, 1);
    Body thin;
    for (int i = 0; i < 150; ++i) {
        const Vec3d a(u(random), u(random), u(random)), along(u(random), u(random), u(random));
        const double width = i % 4 == 0 ? 0 : std::pow(10.0, -3.0 * (i % 4));
        const Vec3d c = i % 10 == 9 ? a : Vec3d(a + 0.3 * along + width * Vec3d(u(random), u(random), u(random)));
        thin.face(thin.vertex(a), thin.vertex(i % 10 == 9 ? a : Vec3d(a + along)), thin.vertex(c));
    }
    compare(thin, TriangleTree(thin.mesh()), 77);
}

TEST(NearestFace, OfEqualDistancesIsTheLowest) {
    const Body box = bodies::box(Vec3d::Ones());
    Body twice = box.with(box);
    for (const VolumeKind kind : kEveryKind) {
        const TriangleTree tree(twice.mesh(), {.volume = kind});
        QueryWork work;
        const auto atCorner = nearestFace(tree, Affine3d::Identity(), Vec3d(3, 3, 3), work);
        ASSERT_TRUE(atCorner);
        std::uint32_t lowest = 0;
        const TriangleMesh mesh = twice.mesh();
        while (double(nearest::distanceTo(mesh.triangle(lowest), Vec3d(3, 3, 3))) > atCorner->distance) ++lowest;
        EXPECT_EQ(atCorner->face, lowest);
    }
}

TEST(NearestFace, WhatIsFartherThanAskedForIsNotLookedFor) {
    const Body box = bodies::box(Vec3d::Ones());
    QueryWork work;
    const Vec3d place(2.5, 0, 0);
    const auto far = nearestFace(box.tree(), Affine3d::Identity(), place, work);
    ASSERT_TRUE(far);
    EXPECT_TRUE(nearestFace(box.tree(), Affine3d::Identity(), place, work, far->distance)) << "as far is not farther";
    EXPECT_FALSE(nearestFace(box.tree(), Affine3d::Identity(), place, work, far->distance * (1 - 1e-9)));
    EXPECT_FALSE(nearestFace(TriangleTree(TriangleMesh()), Affine3d::Identity(), place, work));
    EXPECT_FALSE(nearestFace(box.tree(), Affine3d::Identity(), Vec3d(0, std::nan(""), 0), work));
}

TEST(NearestFace, FewBoxesAreLookedAtAndNoMoreThanAllowed) {
    const Body ball = bodies::sphere(1, 120, 160);
    const std::size_t faces = ball.mesh().faceCount();
    const Vec3d place(1.1, 0.2, 0.3);
    QueryWork work;
    const auto found = nearestFace(ball.tree(), Affine3d::Identity(), place, work);
    ASSERT_TRUE(found);
    EXPECT_LT(work.boxTests + work.triangleTests, faces / 50) << "of " << faces;
    for (std::uint64_t limit = 1; limit < 200; limit += 7) {
        QueryWork little{.limit = limit};
        const auto soon = nearestFace(ball.tree(), Affine3d::Identity(), place, little);
        if (soon)
            EXPECT_EQ(soon->face, found->face) << "what is told is certain";
        else
            EXPECT_TRUE(little.exhausted());
        EXPECT_LT(little.boxTests + little.triangleTests, limit + 20) << "one node more at most";
    }
}

}  // namespace
}  // namespace tessera
