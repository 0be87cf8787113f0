// Sets of points through the table, in the world: beside distances in long double.
#include "common/math/Compose.h"
#include "server/collision/pairwise/PointPairs.h"

#include <gtest/gtest.h>

#include "server/collision/mesh/TriangleContact.h"
#include "server/collision/pairwise/ConservativeBox.h"
#include "tests/unit/query/Bodies.h"
#include "tests/unit/representation/BallOracle.h"

namespace tessera {
namespace {

using namespace bodies;
using oracle::Real;

std::vector<Vec3d> shellOfPoints(Random& random, std::size_t count) {
    std::vector<Vec3d> out;
    for (std::size_t i = 0; i < count; ++i) out.push_back(inCube(random, 1).normalized() * between(random, 0.8, 1.1));
    return out;
}

struct Other {
    const char* name;
    std::shared_ptr<CollisionShape> shape;
};

std::vector<Other> others(Random& random) {
    std::vector<Other> out{{"triangles", CollisionShape::ofTriangles(strewn(random, 90, 0.4))},
                           {"hull", CollisionShape::ofHull(bumpy(random, 5, 7))},
                           {"points", *CollisionShape::ofPoints(shellOfPoints(random, 50), 0.07)}};
    out.push_back({"height field", *CollisionShape::ofHeightField(roughGround(random, 9, 0.5, 0.5))});
    return out;
}

/// Of a point of `points` and a face of the other; below 0 within a hull. In the frame of the points.
Real apart(const PlacedShape& points, const PlacedShape& other, const FacePair& faces) {
    const Vec3d p = points.shape.triangle(faces.a)[0];
    const Affine3d map = points.world.inverse() * other.world;
    if (other.shape.hull() != nullptr) return oracle::fromHull(p, *other.shape.hull(), map);
    return oracle::fromTriangle(p, transformed(map, other.shape.triangle(faces.b)));
}

/// In the frame of the points: as far as the other's balls go.
Real reachOf(const PlacedShape& points, const PlacedShape& other) {
    const Mat3d map = points.world.linear().inverse() * other.world.linear();
    return static_cast<Real>(points.shape.faceRadius() + other.shape.faceRadius() * oracle::largestSingularValue(map));
}

std::size_t facesOf(const CollisionShape& shape) {
    return shape.hull() != nullptr ? 1 : shape.faceCount();
}

TEST(PointPairs, TouchWhereBallsDoUnderEveryMap) {
    Random random(31);
    std::size_t touching = 0;
    for (int round = 0; round < 3; ++round) {
        const auto points = *CollisionShape::ofPoints(shellOfPoints(random, 70), round == 1 ? 0 : 0.1);
        for (const Other& other : others(random))
            for (const NamedMap& map : everyKindOfMap(random)) {
                // A set whose own frame is no similarity to another set's is taken for larger balls: told elsewhere.
                const bool similar = std::string_view(map.name).find("stretched") == std::string_view::npos &&
                                     std::string_view(map.name).find("non-uniform") == std::string_view::npos &&
                                     std::string_view(map.name) != "sheared";
                if (!invertible(map.map) || (other.shape->points() != nullptr && !similar)) continue;
                const Affine3d here = composeTransform(inCube(random, 0.3), anyRotation(random), Vec3d::Constant(1.3));
                const PlacedShape a{*points, map.map}, b{*other.shape, map.map * here};
                const std::string story =
                    std::string(other.name) + ", " + map.name + ", round " + std::to_string(round);
                QueryWork work;
                const PairTouch all = contactsOf(a, b, ~std::size_t{0}, {work}),
                                turned = contactsOf(b, a, ~std::size_t{0}, {work});
                const PairTouch any = touchOf(a, b, {work});
                ASSERT_TRUE(all.complete && turned.complete) << story;
                ASSERT_EQ(any.touch, all.touch) << story;
                const Real reach = reachOf(a, b), hair = 1e-9L;
                std::size_t found = 0;
                for (std::uint32_t p = 0; p < points->faceCount(); ++p)
                    for (std::uint32_t f = 0; f < facesOf(*other.shape); ++f) {
                        const std::uint32_t name = other.shape->hull() != nullptr ? kWhole : f;
                        const Real gap = apart(a, b, {p, f});
                        const bool said = std::ranges::binary_search(all.faces, FacePair{p, name});
                        found += said;
                        ASSERT_EQ(said, std::ranges::binary_search(turned.faces, FacePair{name, p})) << story;
                        if (std::abs(gap - reach) <= hair) continue;
                        ASSERT_EQ(said, gap < reach) << story << ": " << p << "/" << f;
                    }
                ASSERT_EQ(found, all.faces.size()) << story;
                ASSERT_EQ(all.count, all.faces.size());
                touching += found;
            }
    }
    EXPECT_GT(touching, 1000u);
}

TEST(PointPairs, DistancesContactsAndDepthsAreTheWorlds) {
    Random random(32);
    int apartPairs = 0, contacts = 0;
    for (int round = 0; round < 40; ++round) {
        const auto points = *CollisionShape::ofPoints(shellOfPoints(random, 40), 0.08);
        const double scale = between(random, 0.2, 5);
        // Of the points a similarity, mirrored every other time.
        Affine3d world = composeTransform(inCube(random, 2), anyRotation(random), Vec3d::Constant(scale));
        if (round % 2 == 1) world = world * Eigen::Scaling(-1.0, 1.0, 1.0);
        for (const Other& other : others(random)) {
            const bool sets = other.shape->points() != nullptr;
            const Vec3d stretch = sets ? Vec3d::Constant(1.2) : Vec3d(0.7, 1.2, 1);
            const Affine3d there =
                world * composeTransform(inCube(random, round % 3 == 0 ? 4 : 0.8), anyRotation(random), stretch);
            const PlacedShape a{*points, world}, b{*other.shape, there};
            const std::string story = std::string(other.name) + ", round " + std::to_string(round);
            Real least = std::numeric_limits<Real>::infinity();
            for (std::uint32_t p = 0; p < points->faceCount(); ++p)
                for (std::uint32_t f = 0; f < facesOf(*other.shape); ++f) least = std::min(least, apart(a, b, {p, f}));
            const Real gap = static_cast<Real>(scale) * (least - reachOf(a, b));
            QueryWork work;
            for (const bool turn : {false, true}) {
                const WorldDistance far = turn ? distanceInWorld(b, a, {}, work) : distanceInWorld(a, b, {}, work);
                ASSERT_TRUE(far.complete) << story;
                ASSERT_NEAR(far.distance, static_cast<double>(std::max(gap, Real{0})), 1e-9 * scale) << story;
                if (gap > 1e-6L) {
                    ASSERT_NEAR((far.pointA - far.pointB).norm(), far.distance, 1e-9 * scale) << story;
                    ++apartPairs;
                }
                const PairDepth depth = turn ? depthOf(b, a, work) : depthOf(a, b, work);
                ASSERT_TRUE(depth.depth) << story;
                // Within a hull it is measured along the map's directions, so only there for the deepest side.
                if (other.shape->hull() == nullptr || gap > 0) {
                    ASSERT_NEAR(*depth.depth, static_cast<double>(std::max(-gap, Real{0})), 1e-9 * scale) << story;
                }
            }
            for (const FacePair& faces : contactsOf(a, b, 20, {work}).faces) {
                const PairContact contact = contactOfFaces(a, b, faces),
                                  turned = contactOfFaces(b, a, {faces.b, faces.a});
                ++contacts;
                ASSERT_NEAR(contact.normal.norm(), 1, 1e-9) << story;
                ASSERT_TRUE(contact.depth) << story;
                ASSERT_NEAR((contact.normal + turned.normal).norm(), 0, 1e-9) << story;
                ASSERT_NEAR((contact.point - turned.point).norm(), 0, 1e-9 * scale) << story;
                ASSERT_NEAR(*contact.depth, *turned.depth, 1e-9 * scale) << story;
                ASSERT_GE(*contact.depth, 0) << story;
                // The ball, gone that way by the depth, touches no more.
                if (faces.b != kWhole) {
                    const Vec3d centre = world * points->triangle(faces.a)[0] - *contact.depth * contact.normal;
                    Triangle face = transformed(there, other.shape->triangle(faces.b));
                    const Real now = oracle::fromTriangle(centre, face);
                    ASSERT_NEAR(static_cast<double>(now), scale * static_cast<double>(reachOf(a, b)), 1e-8 * scale)
                        << story;
                }
                // The place on the drawn octahedron is on the way from the centre along the normal.
                ASSERT_EQ(contact.faces.a / 8, faces.a) << story;
                const Triangle drawn = transformed(world, points->mesh().triangle(contact.faces.a));
                const Vec3d place =
                    drawn[0] + contact.uvA[0] * (drawn[1] - drawn[0]) + contact.uvA[1] * (drawn[2] - drawn[0]);
                ASSERT_NEAR((place - world * points->triangle(faces.a)[0]).normalized().dot(contact.normal), 1, 1e-9)
                    << story;
            }
        }
    }
    EXPECT_GT(apartPairs, 50);
    EXPECT_GT(contacts, 300);
}

TEST(PointPairs, OfSetsThatAreStretchedAgainstEachOtherNothingIsMissed) {
    Random random(33);
    int touching = 0;
    for (int round = 0; round < 60; ++round) {
        const auto a = *CollisionShape::ofPoints(shellOfPoints(random, 30), 0.1),
                   b = *CollisionShape::ofPoints(shellOfPoints(random, 30), 0.1);
        const Affine3d stretched = composeTransform(inCube(random, 0.4), anyRotation(random), Vec3d(1, 0.4, 1.7));
        const PlacedShape here{*a, Affine3d::Identity()}, there{*b, stretched};
        QueryWork work;
        const PairTouch found = contactsOf(here, there, ~std::size_t{0}, {work});
        // The ellipsoid's points, seen from a ball: a search of its surface from many sides finds only what is there.
        for (std::uint32_t p = 0; p < 30; ++p)
            for (std::uint32_t q = 0; q < 30; ++q) {
                double least = std::numeric_limits<double>::infinity();
                for (int k = 0; k < 40; ++k) {
                    const Vec3d on = stretched * Vec3d(b->triangle(q)[0] + 0.1 * inCube(random, 1).normalized());
                    least = std::min(least, (on - a->triangle(p)[0]).norm());
                }
                if (least > 0.1) continue;
                ++touching;
                ASSERT_TRUE(std::ranges::binary_search(found.faces, FacePair{p, q})) << round << ": " << p << "/" << q;
            }
    }
    EXPECT_GT(touching, 100);
}

TEST(PointPairs, FirstContactsAreThoseOfTheBalls) {
    const std::vector<Vec3d> one{Vec3d(3, 0, 0)};
    const auto ball = *CollisionShape::ofPoints(one, 0.5);
    const auto box = CollisionShape::ofTriangles(meshOf(shapes::box(Vec3d::Constant(2))));
    const BodyMotion still{}, across{.start = {}, .end = {.translation = Vec3d(-3, 0, 0)}};
    QueryWork work;
    for (const double turn : {0.0, 0.7}) {
        BodyMotion turned = across;
        turned.end.rotation = Quatd(Eigen::AngleAxisd(turn, Vec3d::UnitX()));  // about the way: nothing changes
        const Impact met = pairMethods(*box, *ball).firstContact(*box, still, *ball, turned, work, {.tolerance = 1e-6});
        ASSERT_TRUE(met.hit);
        EXPECT_NEAR(met.t, 0.5, 1e-5);
        EXPECT_NEAR((met.normal - Vec3d::UnitX()).norm(), 0, 1e-4);
    }
}

TEST(PointPairs, AskedForABoxAllBallsInItAreNamed) {
    Random random(34);
    const auto points = *CollisionShape::ofPoints(shellOfPoints(random, 3000), 0.02);
    for (int round = 0; round < 50; ++round) {
        Box box;
        box.extend(inCube(random, 1));
        box.extend(inCube(random, 1));
        QueryWork work;
        std::vector<std::uint32_t> near, truth;
        ASSERT_TRUE(facesNear(*points, box, work, near));
        for (std::uint32_t p = 0; p < 3000; ++p) {
            const Vec3d at = points->triangle(p)[0];
            if ((at.array() >= box.lower.array() - 0.02).all() && (at.array() <= box.upper.array() + 0.02).all())
                truth.push_back(p);
        }
        ASSERT_EQ(near, truth);
    }
}

TEST(PointPairs, WhatIsNoSetIsRefused) {
    const std::vector<Vec3d> far{Vec3d(1e50, 0, 0)}, nan{Vec3d(0, std::nan(""), 0)}, fine{Vec3d::Zero()};
    EXPECT_FALSE(CollisionShape::ofPoints(far, 1e50)) << "its octahedra would be no mesh";
    EXPECT_FALSE(CollisionShape::ofPoints(nan, 1));
    EXPECT_FALSE(CollisionShape::ofPoints(fine, -1));
    EXPECT_EQ((*CollisionShape::ofPoints(fine, 1))->mesh().faceCount(), 8u);
}

}  // namespace
}  // namespace tessera
