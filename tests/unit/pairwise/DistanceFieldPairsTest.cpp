// The rows of spherical and of distance fields: every question, beside the trees of the same triangles.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "common/math/Compose.h"
#include "server/collision/pairwise/ConservativeBox.h"
#include "server/collision/pairwise/PairTable.h"
#include "tests/unit/query/Bodies.h"

namespace tessera {
namespace {

using namespace bodies;

using Shape = std::shared_ptr<CollisionShape>;

Shape distanceFieldOf(TriangleMesh mesh, double error) {
    Expected<Shape> made = CollisionShape::ofDistanceField(std::move(mesh), error);
    EXPECT_TRUE(made) << made.error().message;
    return *made;
}

/// What these seeds are made of: closed bumps, boxes, loose triangles, a rough sheet.
TriangleMesh anyMesh(Random& random, unsigned kind) {
    switch (kind % 4) {
        case 0:
            return bumpy(random, 6, 9);
        case 1:
            return meshOf(
                shapes::box(Vec3d(between(random, 0.1, 2), between(random, 0.1, 2), between(random, 0.1, 2))));
        case 2:
            return strewn(random, 60, 0.4);
        default:
            return roughGround(random, 9, 0.5, 0.3);
    }
}

/// The same triangles, looked at in another way; named for the failures.
struct Looks {
    const char* name;
    Shape shape;
    Shape same;  ///< as triangles, or as the hull that it is
};
std::vector<Looks> looksOf(const TriangleMesh& mesh, double error) {
    const Shape triangles = CollisionShape::ofTriangles(mesh);
    std::vector<Looks> out{{"triangles", triangles, triangles},
                           {"spherical", CollisionShape::ofSphericalField(mesh), triangles},
                           {"distance-field", distanceFieldOf(mesh, error), triangles}};
    if (const Shape hull = CollisionShape::ofHull(mesh)) out.push_back({"hull", hull, hull});
    return out;
}

/// Runs `check` for each seed, or for the one that TESSERA_SEED names.
template <typename Check>
void overSeeds(std::uint64_t count, const Check& check) {
    if (const char* only = std::getenv("TESSERA_SEED")) return check(std::strtoull(only, nullptr, 10));
    for (std::uint64_t seed = 0; seed < count && !testing::Test::HasFatalFailure(); ++seed) check(seed);
}

std::string repeat(std::uint64_t seed, const char* filter) {
    return "TESSERA_SEED=" + std::to_string(seed) + " build/bin/unit_pairwise --gtest_filter=" + filter;
}

TEST(DistanceFieldPairs, TouchContactsAndFirstContactsAreThoseOfTheTriangles) {
    int met = 0, apart = 0, hits = 0;
    overSeeds(8, [&](std::uint64_t seed) {
        Random random(seed);
        const TriangleMesh meshA = anyMesh(random, static_cast<unsigned>(seed)),
                           meshB = anyMesh(random, static_cast<unsigned>(seed / 4 + 2));
        const std::vector<Looks> ofA = looksOf(meshA, 0.1), ofB = looksOf(meshB, 0.1);
        for (const NamedMap& map : everyKindOfMap(random)) {
            if (!invertible(map.map)) continue;
            const Affine3d here = composeTransform(inCube(random, 0.5), anyRotation(random), Vec3d::Constant(0.7));
            for (const Looks& a : ofA)
                for (const Looks& b : ofB) {
                    SCOPED_TRACE(repeat(seed, "*ThoseOfTheTriangles") + " " + map.name + ": " + a.name + ", " + b.name);
                    const PlacedShape placedA{*a.shape, here}, placedB{*b.shape, map.map}, trueA{*a.same, here},
                        trueB{*b.same, map.map};
                    QueryWork work;
                    const PairTouch found = contactsOf(placedA, placedB, 1000, {work}),
                                    truth = contactsOf(trueA, trueB, 1000, {work});
                    ASSERT_EQ(found.touch, truth.touch);
                    ASSERT_EQ(found.count, truth.count);
                    ASSERT_EQ(found.faces, truth.faces);
                    ASSERT_EQ(touchOf(placedB, placedA, {work}).touch, truth.touch);
                    ASSERT_EQ(surfaceFacesTouching(placedA, placedB, work).pairs,
                              surfaceFacesTouching(trueA, trueB, work).pairs);
                    (truth.touch == Touch::kYes ? met : apart) += 1;
                    if (a.shape == a.same && b.shape == b.same) continue;
                    const BodyMotion still{.start = Pose{}, .end = Pose{}, .body_T_mesh = here};
                    BodyMotion flies{.start = Pose{}, .end = Pose{}, .body_T_mesh = map.map};
                    flies.end.translation = Vec3d(2, -1, 0.5);
                    const Impact hit =
                        pairMethods(*a.shape, *b.shape).firstContact(*a.shape, still, *b.shape, flies, work, {});
                    const Impact sure =
                        pairMethods(*a.same, *b.same).firstContact(*a.same, still, *b.same, flies, work, {});
                    ASSERT_EQ(hit.hit, sure.hit);
                    ASSERT_EQ(hit.t, sure.t);
                    hits += sure.hit && sure.t > 0;
                }
        }
    });
    if (std::getenv("TESSERA_SEED") != nullptr) return;
    EXPECT_GT(met, 50);
    EXPECT_GT(apart, 50);
    EXPECT_GT(hits, 20);
}

TEST(DistanceFieldPairs, DistancesAreWithinWhatTheySay) {
    int apart = 0, met = 0, byField = 0, within = 0, farther = 0;
    overSeeds(48, [&](std::uint64_t seed) {
        Random random(seed);
        const double errorA = between(random, 0.02, 0.1), errorB = between(random, 0.02, 0.1);
        const TriangleMesh meshA = anyMesh(random, static_cast<unsigned>(seed)),
                           meshB = anyMesh(random, static_cast<unsigned>(seed / 4));
        const std::vector<Looks> ofA = looksOf(meshA, errorA), ofB = looksOf(meshB, errorB);
        // Any pose and size; one in three has B small and within A.
        const double size = std::pow(10.0, between(random, -3, 3));
        const Affine3d stage = composeTransform(inCube(random, 3), anyRotation(random), Vec3d::Constant(size));
        const bool inner = seed % 3 == 0;
        Vec3d scale = Vec3d::Constant(inner ? 0.1 : between(random, 0.3, 1.5));
        if (seed % 5 == 1) scale.x() *= -1;
        if (seed % 7 == 2) scale.y() *= 1.7;
        const Affine3d local = composeTransform(inCube(random, inner ? 0.2 : 2.2), anyRotation(random), scale);
        const Affine3d worldB = stage * local;
        for (const Looks& a : ofA)
            for (const Looks& b : ofB) {
                SCOPED_TRACE(repeat(seed, "*WithinWhatTheySay") + ": " + a.name + ", " + b.name);
                const PlacedShape placedA{*a.shape, stage}, placedB{*b.shape, worldB};
                QueryWork work;
                const double truth = distanceInWorld({*a.same, stage}, {*b.same, worldB}, {}, work).distance;
                const auto judge = [&](const WorldDistance& found) {
                    ASSERT_TRUE(found.complete);
                    ASSERT_FALSE(found.farther);
                    ASSERT_EQ(found.distance == 0, truth == 0);
                    ASSERT_LE(std::abs(found.distance - truth), found.error + 1e-9 * size);
                    // Both are asked for it; a quarter more where rounding or places cannot tell (DistanceLattice.h).
                    const double asked =
                        size * std::max(errorA * meshA.bounds().size().norm(),
                                        errorB * meshB.bounds().size().norm() * scale.cwiseAbs().maxCoeff());
                    ASSERT_LE(found.error, 1.25 * asked);
                    if (found.error > 1e-9 * size) {
                        ASSERT_EQ(found.faces.a, kWhole);
                        ASSERT_LE(std::abs((found.pointA - found.pointB).norm() - found.distance), 1e-6 * size);
                        ++byField;
                    }
                };
                judge(distanceInWorld(placedA, placedB, {}, work));
                judge(distanceInWorld(placedB, placedA, {}, work));
                if (HasFatalFailure()) return;
                (truth > 0 ? apart : met) += 1;
                within += truth > 0 && inner && seed % 4 < 2;
                if (truth == 0) continue;
                // A bound that is nearer than the truth by more than the error says so; one that is not never does.
                for (const double bound : {0.3 * truth, 0.9 * truth, 1.1 * truth, 4 * truth}) {
                    const WorldDistance found = distanceInWorld(placedA, placedB, {.upperBound = bound}, work);
                    ASSERT_TRUE(found.complete);
                    if (found.farther) {
                        ASSERT_GE(truth, bound * (1 - 1e-5)) << "something nearer was missed";
                        ++farther;
                    } else {
                        ASSERT_LE(std::abs(found.distance - truth), found.error + 1e-9 * size) << bound;
                    }
                }
            }
    });
    if (std::getenv("TESSERA_SEED") != nullptr) return;
    EXPECT_GT(apart, 100);
    EXPECT_GT(met, 50);
    EXPECT_GT(byField, 100);
    EXPECT_GT(within, 20) << "one within the other";
    EXPECT_GT(farther, 100);
}

TEST(DistanceFieldPairs, DepthIsThatOfTheDeepestPoint) {
    const TriangleMesh large = meshOf(shapes::box(Vec3d::Constant(4))), small = meshOf(shapes::box(Vec3d::Ones()));
    const Shape shell = distanceFieldOf(large, 0.01), grain = distanceFieldOf(small, 0.01),
                plain = CollisionShape::ofTriangles(small), hull = CollisionShape::ofHull(small);
    struct Case {
        Vec3d at;
        double depth;
        Vec3d out;
    };
    // In the box of 4 a place is 2 less its largest coordinate deep; from outside the small box's own faces count.
    const Case cases[] = {{Vec3d(1.2, 0, 0.1), 1.3, Vec3d::Zero()},
                          {Vec3d(2.2, 0, 0), 0.3, Vec3d::UnitX()},
                          {Vec3d(0.1, -0.3, 2.45), 0.05, Vec3d::UnitZ()},
                          {Vec3d(0, 2.9, 0), 0, Vec3d::Zero()},
                          {Vec3d(40, 0, 0), 0, Vec3d::Zero()}};
    Random random(5);
    for (const Case& it : cases)
        for (const double size : {1.0, 0.003, 700.0}) {
            const Affine3d stage = composeTransform(inCube(random, 3), anyRotation(random), Vec3d(size, size, -size));
            const Affine3d worldB = stage * Eigen::Translation3d(it.at);
            for (const Shape& other : {grain, plain, hull})
                for (const bool turned : {false, true}) {
                    const PlacedShape a{*shell, stage}, b{*other, worldB};
                    QueryWork work;
                    const PairDepth found = turned ? depthOf(b, a, work) : depthOf(a, b, work);
                    ASSERT_TRUE(found.depth);
                    ASSERT_LE(std::abs(*found.depth - it.depth * size), found.error + 1e-6 * size)
                        << it.at.transpose() << nameOf(other->representation());
                    ASSERT_LE(found.error, 1.25 * 0.01 * std::sqrt(48.0) * size);
                    if (it.out.norm() > 0) {
                        ASSERT_GT((turned ? -1 : 1) * found.normal.dot(stage.linear() * it.out) / size, 0.6);
                    }
                }
        }
    // No inside, no depth; but for what is apart.
    const Shape sheet = distanceFieldOf(roughGround(random, 9, 0.5, 0.01), 0.05);
    ASSERT_FALSE(sheet->distanceField()->isSigned());
    const Affine3d here = Affine3d::Identity(), above = here * Eigen::Translation3d(0, 5, 0);
    QueryWork work;
    EXPECT_FALSE(depthOf({*sheet, here}, {*plain, here}, work).depth);
    EXPECT_EQ(depthOf({*sheet, here}, {*plain, above}, work).depth, 0.0);
}

TEST(DistanceFieldPairs, DepthWithOneFieldIsNoLessThanThatOfTheRegions) {
    // A small box half out of a large one. Of the large one's corners none is in the small one.
    const TriangleMesh large = meshOf(shapes::box(Vec3d::Constant(2))),
                       small = meshOf(shapes::box(Vec3d::Constant(0.6)));
    const Shape plain = CollisionShape::ofTriangles(large), hull = CollisionShape::ofHull(large),
                grain = distanceFieldOf(small, 0.02);
    const Affine3d here = Affine3d::Identity(), out = here * Eigen::Translation3d(0.9, 0, 0);
    for (const Shape& other : {plain, hull})
        for (const bool turned : {false, true}) {
            const PlacedShape a{*other, here}, b{*grain, out};
            QueryWork work;
            const PairDepth found = turned ? depthOf(b, a, work) : depthOf(a, b, work);
            ASSERT_TRUE(found.depth);
            EXPECT_NEAR(*found.depth, 0.4, found.error + 1e-7) << "corners are floats";
            EXPECT_LT(found.error, 0.1);
            EXPECT_GT((turned ? -1 : 1) * found.normal.x(), 0.99);
        }
}

TEST(DistanceFieldPairs, WorkThatEndsGivesALowerBound) {
    Random random(9);
    const TriangleMesh mesh = bumpy(random, 16, 24);
    const Shape a = distanceFieldOf(mesh, 0.02), b = CollisionShape::ofTriangles(mesh);
    const Affine3d here = Affine3d::Identity(), there = here * Eigen::Translation3d(2.6, 0, 0);
    QueryWork all;
    const double truth = distanceInWorld({*b, here}, {*b, there}, {}, all).distance;
    int cut = 0;
    for (std::uint64_t limit = 0; limit < 60; limit += 3) {
        QueryWork work{.limit = limit};
        const WorldDistance found = distanceInWorld({*a, here}, {*b, there}, {}, work);
        if (found.complete) continue;
        ++cut;
        ASSERT_LE(found.distance, truth);
    }
    EXPECT_GT(cut, 0);
}

TEST(DistanceFieldPairs, EveryPairOfTheTableSaysWhoAnswers) {
    using enum Representation;
    for (std::size_t a = 0; a < kRepresentations; ++a)
        for (std::size_t b = 0; b < kRepresentations; ++b) {
            const PairMethods &there = pairMethods(Representation(a), Representation(b)),
                              &back = pairMethods(Representation(b), Representation(a));
            EXPECT_EQ(there.name, back.name);
            EXPECT_FALSE(nameOf(Representation(a)).empty());
            if (Representation(a) == kFreeform || Representation(b) == kFreeform) {
                const auto beside = Representation(a) == kFreeform ? Representation(b) : Representation(a);
                const bool byTriangles = beside == kHeightField || beside == kPoints;
                EXPECT_EQ(there.approximate, byTriangles ? kNoQuestion : kEveryQuestion) << a << b;
                EXPECT_EQ(there.byTrees, byTriangles ? kEveryQuestion : kNoQuestion) << a << b;
                continue;
            }
            const bool field = Representation(a) == kDistanceField || Representation(b) == kDistanceField;
            const auto other = Representation(a) == kDistanceField ? Representation(b) : Representation(a);
            const bool lattice = field && other != kHeightField && other != kPoints;
            EXPECT_EQ(there.approximate, lattice ? kDistanceQuestion | kDepthQuestion : kNoQuestion) << a << b;
        }
    EXPECT_EQ(pairMethods(kSpherical, kHull).byTrees, kEveryQuestion);
    EXPECT_EQ(pairMethods(kSpherical, kTriangles).byTrees & kTouchQuestion, 0);
}

TEST(DistanceFieldPairs, RefusalsLeaveTheMesh) {
    TriangleMesh box = meshOf(shapes::box(Vec3d::Ones()));
    for (const double error : {0.0, -1.0, 0.0001, 0.3, std::nan("")}) {
        const auto refused = CollisionShape::ofDistanceField(std::move(box), error);
        EXPECT_FALSE(refused) << error;
        ASSERT_EQ(box.faceCount(), 12U);
    }
    const auto places = CollisionShape::ofDistanceField(std::move(box), 0.001);
    ASSERT_FALSE(places);
    EXPECT_EQ(places.error().code, ErrorCode::kLimit);
    EXPECT_EQ(box.faceCount(), 12U);
    EXPECT_FALSE(CollisionShape::ofDistanceField(TriangleMesh{}, 0.01));
}

}  // namespace
}  // namespace tessera
