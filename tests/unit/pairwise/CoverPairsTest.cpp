// Surfaces looked at as balls that cover them, beside the surfaces themselves.
#include <gtest/gtest.h>

#include "common/math/Compose.h"
#include "server/collision/pairwise/ConservativeBox.h"
#include "server/collision/pairwise/PairContact.h"
#include "server/collision/representation/PointSetQueries.h"
#include "tests/unit/query/Bodies.h"

namespace tessera {
namespace {

using namespace bodies;

std::shared_ptr<CollisionShape> coverOfMesh(TriangleMesh mesh, unsigned level) {
    const Expected<std::shared_ptr<CollisionShape>> made = CollisionShape::ofCover(std::move(mesh), level);
    EXPECT_TRUE(made) << made.error().message;
    return made ? *made : nullptr;
}

/// A body as it is, and as what it is looked at instead.
struct Looked {
    const char* name;
    std::shared_ptr<CollisionShape> exact, seen;
};

std::vector<Looked> partners(Random& random) {
    const unsigned level = 1 + static_cast<unsigned>(random() % 6);
    const TriangleMesh loose = strewn(random, 40, 0.4), land = roughGround(random, 12, 0.3, 0.4);
    std::vector<Vec3d> places;
    for (int i = 0; i < 40; ++i) places.push_back(inCube(random, 1));
    const auto triangles = CollisionShape::ofTriangles(loose), hull = CollisionShape::ofHull(bumpy(random, 5, 7));
    const auto field = *CollisionShape::ofHeightField(land), points = *CollisionShape::ofPoints(places, 0.05);
    return {{"triangles", triangles, triangles},
            {"hull", hull, hull},
            {"height field", field, field},
            {"points", points, points},
            {"cover", triangles, coverOfMesh(loose, level)},
            {"cover of a field's mesh", CollisionShape::ofTriangles(land), coverOfMesh(land, level)}};
}

struct Seen {
    int touching = 0, almost = 0, apart = 0;
};

void compare(const PlacedShape& a, const PlacedShape& b, const PlacedShape& exactA, const PlacedShape& exactB,
             Seen& seen) {
    QueryWork work;
    const double error = coverError(a, b);
    ASSERT_GT(error, 0);
    ASSERT_EQ(coverError(b, a), error);
    ASSERT_EQ(coverError(exactA, exactB), 0);
    const bool touches = touchOf(exactA, exactB, {work}).touch == Touch::kYes,
               told = touchOf(a, b, {work}).touch == Touch::kYes;
    const double truth = distanceInWorld(exactA, exactB, {}, work).distance,
                 distance = distanceInWorld(a, b, {}, work).distance;
    const double rounding = 1e-9 * (1 + truth);
    if (touches) {
        ASSERT_TRUE(told);
        ASSERT_EQ(distance, 0);
        ASSERT_TRUE(depthOf(a, b, work).depth);
    }
    ASSERT_TRUE(!told || truth <= error + rounding) << truth << " " << error;
    ASSERT_LE(distance, truth + rounding);
    ASSERT_GE(distance, truth - error - rounding);
    ASSERT_EQ(told, touchOf(b, a, {work}).touch == Touch::kYes);
    seen.touching += touches;
    seen.almost += told && !touches;
    seen.apart += !told;
}

TEST(CoverPairs, NeverMissWhatTouchesAndAreWrongByTheirErrorAtMost) {
    Random random(31);
    Seen seen, stretched;
    for (int round = 0; round < 50; ++round)
        for (const Looked& other : partners(random)) {
            const unsigned level = 1 + static_cast<unsigned>(random() % 7);
            const TriangleMesh mesh = round % 2 == 0 ? strewn(random, 50, 0.5) : bumpy(random, 8, 11);
            const auto exact = CollisionShape::ofTriangles(mesh), cover = coverOfMesh(mesh, level);
            SCOPED_TRACE(std::string(other.name) + ", level " + std::to_string(level) + ", round " +
                         std::to_string(round));
            const double scale = between(random, 0.3, 2);
            for (const double away : {0.7, 1.5, 2.5}) {
                const Affine3d here = composeTransform(inCube(random, 5), anyRotation(random), Vec3d::Constant(scale));
                const Affine3d there =
                    composeTransform(here.translation() + inCube(random, 1).normalized() * away * scale,
                                     anyRotation(random), Vec3d::Constant(between(random, 0.3, 2)));
                compare({*cover, here}, {*other.seen, there}, {*exact, here}, {*other.exact, there}, seen);
                if (HasFatalFailure()) return;
                // Points of their own are solid as they are stretched in the cover's frame; all else has one truth.
                if (other.exact->points() != nullptr) continue;
                Affine3d skewed = there;
                skewed.linear() *= Vec3d(between(random, 0.5, 2), between(random, 0.5, 2), -1).asDiagonal();
                compare({*cover, here}, {*other.seen, skewed}, {*exact, here}, {*other.exact, skewed}, stretched);
                compare({*cover, skewed}, {*other.seen, here}, {*exact, skewed}, {*other.exact, here}, stretched);
                if (HasFatalFailure()) return;
            }
        }
    for (const Seen& s : {seen, stretched}) {
        EXPECT_GT(s.touching, 150);
        EXPECT_GT(s.almost, 30);
        EXPECT_GT(s.apart, 100);
    }
}

TEST(CoverPairs, AreAsFarApartAsTheirBallsWhoeverMeasures) {
    Random random(36);
    int apart = 0, touching = 0, farther = 0;
    for (int round = 0; round < 60; ++round) {
        const TriangleMesh mesh = bumpy(random, 8, 11), loose = strewn(random, 40, 0.4);
        const auto a = coverOfMesh(mesh, 1 + round % 6), b = coverOfMesh(loose, 2 + round % 5),
                   surface = CollisionShape::ofTriangles(loose);
        Affine3d map =
            composeTransform(inCube(random, 3), anyRotation(random), Vec3d::Constant(between(random, 0.3, 2)));
        if (round % 3 == 2) map.linear() *= Vec3d(0.5, -1, 1.3).asDiagonal();
        const DistanceOptions options{.upperBound = round % 4 == 0 ? 0.7 : std::numeric_limits<double>::infinity()};
        const auto expectSame = [&](const Distance& found, const Distance& plain) {
            ASSERT_TRUE(found.complete && plain.complete);
            ASSERT_EQ(found.farther, plain.farther);
            ASSERT_EQ(found.distance == 0, plain.distance == 0);
            ASSERT_NEAR(found.distance, plain.distance, 1e-12 * (1 + plain.distance));
            farther += found.farther;
            touching += found.distance == 0;
            apart += found.distance > 0 && !found.farther;
        };
        QueryWork work;
        expectSame(pairMethods(*a, *b).distance(*a, *b, map, work, options),
                   distanceBetween(*a->points(), *b->points(), map, work, options));
        expectSame(pairMethods(*a, *surface).distance(*a, *surface, map, work, options),
                   distanceBetween(*a->points(), surface->tree(), map, work, options));
        expectSame(pairMethods(*surface, *a).distance(*surface, *a, map, work, options),
                   distanceBetween(surface->tree(), *a->points(), map, work, options));
        if (HasFatalFailure()) return;
    }
    EXPECT_GT(apart, 40);
    EXPECT_GT(touching, 15);
    EXPECT_GT(farther, 5);
}

TEST(CoverPairs, MeetNoLaterThanTheirSurfaces) {
    Random random(32);
    int hits = 0, early = 0, none = 0;
    for (int round = 0; round < 40; ++round)
        for (const Looked& other : partners(random)) {
            const unsigned level = 2 + static_cast<unsigned>(random() % 5);
            const TriangleMesh mesh = round % 2 == 0 ? strewn(random, 40, 0.5) : bumpy(random, 8, 11);
            const auto exact = CollisionShape::ofTriangles(mesh), cover = coverOfMesh(mesh, level);
            SCOPED_TRACE(std::string(other.name) + ", level " + std::to_string(level) + ", round " +
                         std::to_string(round));
            const BodyMotion still{.start = Pose{}, .end = Pose{}, .body_T_mesh = Affine3d::Identity()};
            BodyMotion goes = still;
            goes.start = {.translation = inCube(random, 1).normalized() * 4, .rotation = anyRotation(random)};
            goes.end = {.translation = inCube(random, 4), .rotation = anyRotation(random)};
            const ImpactOptions options{.tolerance = 1e-6};
            QueryWork work;
            const Impact truth =
                pairMethods(*exact, *other.exact).firstContact(*exact, still, *other.exact, goes, work, options);
            const Impact found =
                pairMethods(*cover, *other.seen).firstContact(*cover, still, *other.seen, goes, work, options);
            ASSERT_TRUE(truth.complete && found.complete);
            if (truth.hit) {
                ASSERT_TRUE(found.hit);
                ASSERT_LE(found.t, truth.t + 1e-5);
            }
            hits += truth.hit;
            early += found.hit && !truth.hit;
            none += !found.hit;
            if (!found.hit) continue;
            const Affine3d here = Affine3d::Identity(), there = goes.placeAt(found.t);
            const double error = coverError({*cover, here}, {*other.seen, there});
            ASSERT_LE(distanceInWorld({*exact, here}, {*other.exact, there}, {}, work).distance, error + 2e-6);
        }
    EXPECT_GT(hits, 60);
    EXPECT_GT(early, 5);
    EXPECT_GT(none, 20);
}

TEST(CoverPairs, KeepTheirSurfaceForThoseWhoTakeThatAndNameItsFaces) {
    Random random(33);
    int seen = 0;
    for (int round = 0; round < 20; ++round) {
        const TriangleMesh mesh = bumpy(random, 9, 12);
        const auto cover = coverOfMesh(mesh, 5), other = round % 2 == 0
                                                             ? coverOfMesh(strewn(random, 40, 0.5), 4)
                                                             : CollisionShape::ofTriangles(strewn(random, 40, 0.5));
        EXPECT_EQ(cover->representation(), Representation::kPoints);
        ASSERT_EQ(cover->mesh().faceCount(), mesh.faceCount());
        for (std::uint32_t face = 0; face < mesh.faceCount(); ++face)
            EXPECT_EQ(cover->mesh().triangle(face), mesh.triangle(face));
        EXPECT_EQ(&cover->tree().mesh(), &cover->mesh());
        EXPECT_GE(cover->memoryBytes(), mesh.memoryBytes() + cover->points()->memoryBytes());
        const Affine3d here = composeTransform(inCube(random, 1), anyRotation(random), Vec3d::Constant(1.3)),
                       there = composeTransform(inCube(random, 1), anyRotation(random), Vec3d::Ones());
        const PlacedShape a{*cover, here}, b{*other, there};
        const double error = coverError(a, b);
        QueryWork work;
        const PairTouch found = contactsOf(a, b, 200, {work});
        for (const FacePair& faces : found.faces) {
            ASSERT_LT(faces.a, cover->faceCount());
            const PairContact contact = contactOfFaces(a, b, faces);
            ASSERT_EQ(contact.faces.a, cover->coveredFace(faces.a));
            ASSERT_LT(contact.faces.a, mesh.faceCount());
            ASSERT_EQ(drawnFace(a, faces.a, Vec3d::UnitX()), contact.faces.a);
            for (const auto& [shape, face, uv] :
                 {std::tuple(a, contact.faces.a, contact.uvA), std::tuple(b, contact.faces.b, contact.uvB)}) {
                if (!shape.shape.isCover()) continue;
                const Triangle t = transformed(shape.world, shape.shape.mesh().triangle(face));
                const Vec3d at = t[0] + uv.x() * (t[1] - t[0]) + uv.y() * (t[2] - t[0]);
                ASSERT_LE((at - contact.point).norm(), error) << "what is drawn is where the surface is";
            }
            ++seen;
        }
    }
    EXPECT_GT(seen, 500);
}

TEST(CoverPairs, SeenFromAnotherFrameTheyStillCoverTheSurfaceThere) {
    Random random(34);
    for (const NamedMap& map : everyKindOfMap(random)) {
        if (!invertible(map.map)) continue;
        SCOPED_TRACE(map.name);
        const TriangleMesh mesh = bumpy(random, 6, 8);
        const auto placed = coverOfMesh(mesh, 4)->placed(map.map);
        ASSERT_TRUE(placed && placed->isCover());
        ASSERT_EQ(placed->mesh().faceCount(), mesh.faceCount());
        for (std::uint32_t face = 0; face < mesh.faceCount(); ++face) {
            const Triangle t = placed->mesh().triangle(face);
            EXPECT_EQ(t, transformed(map.map, mesh.triangle(face)));
            const Vec3d p = (t[0] + t[1] + t[2]) / 3;
            double nearest = std::numeric_limits<double>::infinity();
            for (std::uint32_t ball = 0; ball < placed->faceCount(); ++ball)
                nearest = std::min(nearest, (placed->triangle(ball)[0] - p).norm());
            EXPECT_LE(nearest, placed->faceRadius() * (1 + 1e-12));
        }
    }
}

TEST(CoverPairs, AMeshThatCannotBeCoveredStaysWithWhoeverAsked) {
    Random random(35);
    TriangleMesh mesh = bumpy(random, 9, 12);
    EXPECT_FALSE(CollisionShape::ofCover(std::move(mesh), 12));
    EXPECT_EQ(mesh.faceCount(),
              bumpy(random, 9, 12).faceCount());  // NOLINT(bugprone-use-after-move): that is the point
}

}  // namespace
}  // namespace tessera
