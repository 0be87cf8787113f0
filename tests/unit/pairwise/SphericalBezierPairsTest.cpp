// Shapes looked at by spherical Bézier patches, beside the same as triangles: patches reject, and no answer differs.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "common/math/Compose.h"
#include "server/collision/pairwise/PairTable.h"
#include "server/collision/spherical_bezier/SphericalBezierTouch.h"
#include "tests/support/words/Words.h"
#include "tests/unit/query/Bodies.h"

namespace tessera {
namespace {

using namespace bodies;

/// One body twice: by patches and by triangles, moved alike.
struct Twice {
    std::shared_ptr<CollisionShape> patches, triangles;
    std::vector<Vec3d> rest, now;

    Twice(const TriangleMesh& mesh, bool deforms) {
        TriangleMesh copy = mesh;
        patches = CollisionShape::ofSphericalBezier(std::move(copy), {.volume = kAutomaticDeformingVolume}).value();
        triangles = CollisionShape::ofTriangles(mesh, {.volume = kAutomaticDeformingVolume});
        for (const Vec3d p : mesh.positions()) rest.push_back(p);
        now = rest;
        if (!deforms) return;
        patches->setDeforms();
        triangles->setDeforms();
    }
    void deform(Random& random) {
        const bool all = random() % 2 == 0;
        const std::size_t first = all ? 0 : random() % rest.size(),
                          count = all ? rest.size() : 1 + random() % (rest.size() - first);
        const Vec3d wave = inCube(random, 4);
        // Now and then it is folded, and star-shaped no more.
        const double noise = random() % 3 == 0 ? 0.3 : 0.0, fold = random() % 5 == 0 ? -1 : 1;
        for (std::size_t i = first; i < first + count; ++i) {
            now[i] = rest[i] * (1 + 0.3 * std::sin(wave.dot(rest[i]))) + inCube(random, noise);
            if (now[i].x() < 0) now[i].x() *= fold;
        }
        const std::span<const Vec3d> range(now.data() + first, count);
        ASSERT_TRUE(patches->move(first, range));
        ASSERT_TRUE(triangles->move(first, range));
    }
};

void expectEqual(const PlacedShape& a, const PlacedShape& b, const PlacedShape& plainA, const PlacedShape& plainB,
                 std::size_t& met) {
    QueryWork work, plainWork;
    const PairTouch found = contactsOf(a, b, 100, {work}), truth = contactsOf(plainA, plainB, 100, {plainWork});
    ASSERT_EQ(found.touch, truth.touch);
    ASSERT_EQ(found.count, truth.count);
    ASSERT_EQ(found.faces, truth.faces);
    const PairTouch one = touchOf(a, b, {work}), plainOne = touchOf(plainA, plainB, {plainWork});
    ASSERT_EQ(one.touch, plainOne.touch);
    ASSERT_EQ(one.faces, plainOne.faces);
    ASSERT_EQ(one.touch, truth.touch);
    met += truth.touch == Touch::kYes ? 1 : 0;
}

TEST(SphericalBezierPairs, AnswerAsTrianglesWhateverDeforms) {
    std::size_t met = 0, rejected = 0, asked = 0;
    const char* const only = std::getenv("TESSERA_SEED");
    for (std::uint64_t seed = only ? std::strtoull(only, nullptr, 10) : 0;
         seed < (only ? std::strtoull(only, nullptr, 10) + 1 : 12); ++seed) {
        SCOPED_TRACE("TESSERA_SEED=" + std::to_string(seed) +
                     " build/bin/unit_pairwise --gtest_filter=SphericalBezierPairs.Answer*");
        Random random(seed);
        Twice a(bumpy(random, 12, 16), true), b(bumpy(random, 8, 12), seed % 2 == 0);
        const auto still = CollisionShape::ofTriangles(strewn(random, 90, 0.5));
        for (int step = 0; step < 40; ++step) {
            a.deform(random);
            if (b.patches->deforms()) b.deform(random);
            if (testing::Test::HasFatalFailure()) return;
            const Vec3d stretch(1, random() % 3 == 0 ? -1 : 1, random() % 4 == 0 ? 1.2 : 1);
            const Affine3d here = composeTransform(inCube(random, 0.3), anyRotation(random),
                                                   Vec3d::Constant(between(random, 0.5, 2))),
                           there = composeTransform(between(random, 0.5, 3) * inCube(random, 1).normalized(),
                                                    anyRotation(random), stretch);
            expectEqual({*a.patches, here}, {*b.patches, there}, {*a.triangles, here}, {*b.triangles, there}, met);
            expectEqual({*a.patches, here}, {*b.triangles, there}, {*a.triangles, here}, {*b.triangles, there}, met);
            expectEqual({*still, there}, {*a.patches, here}, {*still, there}, {*a.triangles, here}, met);
            if (testing::Test::HasFatalFailure()) return;
            asked += 3;
            QueryWork patchWork;
            const bool areApart = patchesThatMayMeet(*a.patches->sphericalBezier(), *b.patches->sphericalBezier(),
                                                     here.inverse() * there, patchWork)
                                      .empty();
            rejected += areApart && a.patches->boxIn(here).overlaps(b.patches->boxIn(there)) ? 1 : 0;
            if (step % 5 != 0) continue;
            QueryWork work;
            ASSERT_EQ(distanceInWorld({*a.patches, here}, {*b.patches, there}, {}, work).distance,
                      distanceInWorld({*a.triangles, here}, {*b.triangles, there}, {}, work).distance);
            ASSERT_EQ(depthOf({*a.patches, here}, {*b.patches, there}, work).depth,
                      depthOf({*a.triangles, here}, {*b.triangles, there}, work).depth);
        }
    }
    if (only) return;
    EXPECT_GT(met, asked / 5);
    EXPECT_GT(rejected, 10U) << "that boxes do not tell apart";
}

/// Of every representation: what it answers beside patches is what it answers beside triangles, to the bit.
TEST(SphericalBezierPairs, AnswerAsTrianglesBesideEverythingElse) {
    Random random(3);
    const TriangleMesh ball = bumpy(random, 10, 14), other = bumpy(random, 9, 12),
                       ground = roughGround(random, 20, 0.2, 0.1);
    const Twice body(ball, false);
    const auto copyOf = [](const TriangleMesh& mesh) { return TriangleMesh(mesh); };
    std::vector<Vec3d> places;
    for (const Vec3d p : other.positions()) places.push_back(p);
    const std::vector<std::shared_ptr<CollisionShape>> others{
        CollisionShape::ofTriangles(copyOf(other)),
        CollisionShape::ofHull(other),
        CollisionShape::ofHeightField(ground).value(),
        CollisionShape::ofPoints(places, 0.05).value(),
        CollisionShape::ofCover(copyOf(other), 4).value(),
        CollisionShape::ofSphericalField(copyOf(other)),
        CollisionShape::ofDistanceField(copyOf(other), 0.02).value(),
        CollisionShape::ofFreeform(FreeformShape::ofTriangles(other).value(), copyOf(other), 1e-4)};
    for (const auto& beside : others)
        for (int i = 0; i < 30; ++i) {
            SCOPED_TRACE(std::string(nameOf(beside->representation())) + ", pose " + std::to_string(i));
            const Affine3d here = Affine3d::Identity(),
                           there = composeTransform(between(random, 0, 2.5) * inCube(random, 1).normalized(),
                                                    anyRotation(random), Vec3d::Ones());
            QueryWork work;
            const PairTouch found = contactsOf({*body.patches, here}, {*beside, there}, 50, {work}),
                            truth = contactsOf({*body.triangles, here}, {*beside, there}, 50, {work});
            ASSERT_EQ(found.touch, truth.touch);
            ASSERT_EQ(found.faces, truth.faces);
            const WorldDistance far = distanceInWorld({*body.patches, here}, {*beside, there}, {}, work),
                                plain = distanceInWorld({*body.triangles, here}, {*beside, there}, {}, work);
            ASSERT_EQ(far.distance, plain.distance);
            ASSERT_EQ(depthOf({*body.patches, here}, {*beside, there}, work).depth,
                      depthOf({*body.triangles, here}, {*beside, there}, work).depth);
            const BodyMotion motion{{.translation = {4, 0.1, 0}}, {.translation = {-4, 0, 0.1}}};
            const Impact hit = pairMethods(*body.patches, *beside)
                                   .firstContact(*body.patches, BodyMotion{}, *beside, motion, work, {}),
                         plainHit = pairMethods(*body.triangles, *beside)
                                        .firstContact(*body.triangles, BodyMotion{}, *beside, motion, work, {});
            ASSERT_EQ(hit.hit, plainHit.hit);
            ASSERT_EQ(hit.t, plainHit.t);
        }
}

TEST(SphericalBezierPairs, WhatIsNotStarShapedIsRefusedInWordsAndStays) {
    Random random(4);
    TriangleMesh loose = strewn(random, 50, 0.5);
    const std::size_t faces = loose.faceCount();
    const auto refused = CollisionShape::ofSphericalBezier(std::move(loose));
    ASSERT_FALSE(refused);
    EXPECT_WORDS(refused.error().message);
    EXPECT_EQ(loose.faceCount(), faces);
    EXPECT_EQ(nameOf(Representation::kSphericalBezier), "spherical-bezier");
}

}  // namespace
}  // namespace tessera
