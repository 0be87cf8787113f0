#include "common/math/Compose.h"
#include "server/collision/pairwise/PairTable.h"

#include <gtest/gtest.h>

#include <thread>

#include "server/collision/mesh/TriangleContact.h"
#include "server/collision/pairwise/ConservativeBox.h"
#include "server/collision/pairwise/PairContact.h"
#include "server/collision/pairwise/Regions.h"
#include "tests/unit/query/Bodies.h"

namespace tessera {
namespace {

using namespace bodies;

constexpr std::size_t kAll = ~std::size_t{0};

std::vector<FacePair> contactsBetween(const PlacedShape& a, const PlacedShape& b) {
    QueryWork work;
    return contactsOf(a, b, kAll, {work}).faces;
}

/// In the frame of the one with more faces, as the room promises.
std::vector<FacePair> bruteForceOf(const PlacedShape& a, const PlacedShape& b) {
    if (b.shape.mesh().faceCount() <= a.shape.mesh().faceCount())
        return bruteForce(a.shape.mesh(), b.shape.mesh(), a.world.inverse() * b.world);
    std::vector<FacePair> pairs = bruteForce(b.shape.mesh(), a.shape.mesh(), b.world.inverse() * a.world);
    for (FacePair& faces : pairs) std::swap(faces.a, faces.b);
    std::ranges::sort(pairs);
    return pairs;
}

/// Least distance of any two faces, in the world.
double bruteDistance(const PlacedShape& a, const PlacedShape& b) {
    double least = std::numeric_limits<double>::infinity();
    for (std::uint32_t f = 0; f < a.shape.mesh().faceCount(); ++f) {
        const Triangle x = transformed(a.world, a.shape.mesh().triangle(f));
        for (std::uint32_t g = 0; g < b.shape.mesh().faceCount(); ++g) {
            const Triangle y = transformed(b.world, b.shape.mesh().triangle(g));
            least = std::min(least, trianglesIntersect(x, y) ? 0 : nearestPoints(x, y).distance);
        }
    }
    return least;
}

TEST(PairTable, VolumesChangeNoAnswer) {
    Random random(11);
    int touching = 0;
    for (int round = 0; round < 6; ++round) {
        const TriangleMesh meshA = bumpy(random, 7, 10), meshB = strewn(random, 60 + 120 * (round % 2), 0.4);
        for (const NamedMap& map : everyKindOfMap(random)) {
            if (!invertible(map.map)) continue;  // such a part meets nothing
            const Affine3d worldA = composeTransform(inCube(random, 0.5), anyRotation(random), Vec3d::Ones());
            const VolumeKind kindA = kVolumes[random() % kVolumeKinds], kindB = kVolumes[random() % kVolumeKinds];
            const auto a = CollisionShape::ofTriangles(meshA, {.volume = kindA}),
                       b = CollisionShape::ofTriangles(meshB, {.volume = kindB});
            const PlacedShape placedA{*a, worldA}, placedB{*b, map.map};
            const std::vector<FacePair> truth = bruteForceOf(placedA, placedB);
            ASSERT_EQ(contactsBetween(placedA, placedB), truth) << round << " " << map.name;
            std::vector<FacePair> turned = contactsBetween(placedB, placedA);
            for (FacePair& faces : turned) std::swap(faces.a, faces.b);
            std::ranges::sort(turned);
            ASSERT_EQ(turned, truth) << "whoever is called A: " << round << " " << map.name;
            PairHints hints;
            QueryWork work;
            ASSERT_EQ(touchOf(placedA, placedB, {work, &hints}).touch == Touch::kYes, !truth.empty());
            touching += !truth.empty();
        }
    }
    EXPECT_GT(touching, 20);
}

TEST(PairTable, DistancesAreThoseOfTheWorldUnderEveryMap) {
    Random random(12);
    for (int round = 0; round < 4; ++round) {
        const auto a = CollisionShape::ofTriangles(bumpy(random, 5, 7)),
                   b = CollisionShape::ofTriangles(bumpy(random, 4, 6));
        for (const NamedMap& mapA : everyKindOfMap(random))
            for (const NamedMap& mapB : everyKindOfMap(random)) {
                if (!invertible(mapA.map) || !invertible(mapB.map)) continue;
                const PlacedShape placedA{*a, mapA.map}, placedB{*b, mapB.map};
                QueryWork work;
                const WorldDistance found = distanceInWorld(placedA, placedB, {}, work);
                const double truth = bruteDistance(placedA, placedB);
                const double extent = mapA.map.matrix().cwiseAbs().maxCoeff() + mapB.map.matrix().cwiseAbs().maxCoeff();
                ASSERT_TRUE(found.complete);
                ASSERT_NEAR(found.distance, truth, 1e-11 * extent) << mapA.name << ", " << mapB.name;
                if (truth > 1e-9 * extent) {
                    ASSERT_NEAR((found.pointA - found.pointB).norm(), found.distance, 1e-11 * extent);
                }
            }
    }
}

TEST(PairTable, HullsAreFull) {
    const TriangleMesh large = meshOf(shapes::box(Vec3d::Constant(4))), small = meshOf(shapes::box(Vec3d::Ones()));
    const auto solid = CollisionShape::ofHull(large), grain = CollisionShape::ofHull(small);
    const auto shell = CollisionShape::ofTriangles(large), thing = CollisionShape::ofTriangles(small);
    const Affine3d here = Affine3d::Identity(),
                   within = composeTransform(Vec3d(0.3, -0.2, 0.9), Quatd(0.8, 0.6, 0, 0), Vec3d::Ones()),
                   beside = composeTransform(Vec3d(4, 0, 0), Quatd::Identity(), Vec3d::Ones());
    const auto ask = [&](const CollisionShape& a, const CollisionShape& b, const Affine3d& at) {
        PairHints hints;
        QueryWork work;
        const PairTouch touch = touchOf({a, here}, {b, at}, {work, &hints}),
                        all = contactsOf({a, here}, {b, at}, kAll, {work, &hints});
        EXPECT_EQ(touch.touch, all.touch);
        EXPECT_EQ(all.count, all.touch == Touch::kYes ? 1u : 0u);
        EXPECT_TRUE(all.faces.empty());
        const WorldDistance far = distanceInWorld({a, here}, {b, at}, {}, work);
        EXPECT_TRUE(far.complete);
        EXPECT_EQ(far.distance == 0, all.touch == Touch::kYes);
        return far.distance;
    };
    EXPECT_EQ(ask(*solid, *grain, within), 0);
    EXPECT_EQ(ask(*solid, *thing, within), 0);
    EXPECT_EQ(ask(*thing, *solid, within), 0) << "a box of 4 about the origin holds both";
    EXPECT_GT(ask(*shell, *thing, within), 0) << "a shell is hollow";
    EXPECT_GT(ask(*shell, *grain, within), 0);
    EXPECT_NEAR(ask(*solid, *grain, beside), 1.5, 1e-12);
    EXPECT_NEAR(ask(*solid, *thing, beside), 1.5, 1e-12);
}

TEST(PairTable, DepthIsThatOfTheWorld) {
    Random random(13);
    const TriangleMesh table = meshOf(shapes::box(Vec3d(4, 4, 1))), box = meshOf(shapes::box(Vec3d::Ones()));
    for (const bool hulls : {false, true})
        for (const double scale : {1.0, 0.01, 300.0})
            for (const bool mirrored : {false, true}) {
                const auto a = hulls ? CollisionShape::ofHull(table) : CollisionShape::ofTriangles(table);
                const auto b = hulls ? CollisionShape::ofHull(box) : CollisionShape::ofTriangles(box);
                // Not a similarity: twice as high as wide.
                const Affine3d stage =
                    composeTransform(inCube(random, 3), anyRotation(random), Vec3d::Constant(scale)) *
                    Eigen::Scaling(mirrored ? -1.0 : 1.0, 1.0, 2.0);
                const Affine3d worldB = stage * Eigen::Translation3d(0.13, -0.21, 0.9);
                QueryWork work;
                const PairDepth found = depthOf({*a, stage}, {*b, worldB}, work);
                ASSERT_TRUE(found.depth) << hulls << scale << mirrored;
                EXPECT_NEAR(*found.depth, 0.2 * scale, 1e-9 * scale);
                const Vec3d up = stage.linear().col(2).normalized();
                EXPECT_LT((found.normal - up).norm(), 1e-9) << hulls << scale << mirrored;
                const PairDepth back = depthOf({*b, worldB}, {*a, stage}, work);
                ASSERT_TRUE(back.depth);
                EXPECT_NEAR(*back.depth, 0.2 * scale, 1e-9 * scale);
                EXPECT_LT((back.normal + up).norm(), 1e-9);
                const Affine3d far = worldB * Eigen::Translation3d(0, 0, 1);
                EXPECT_EQ(depthOf({*a, stage}, {*b, far}, work).depth, 0.0) << "apart";
            }
    const auto sheet = CollisionShape::ofTriangles(meshOf(shapes::sheet(4, 4))),
               thing = CollisionShape::ofTriangles(box);
    const Affine3d here = Affine3d::Identity();
    QueryWork work;
    EXPECT_FALSE(depthOf({*sheet, here}, {*thing, here}, work).depth) << "a sheet has no inside";
}

TEST(PairTable, AllContactsOfARegionPointOneWay) {
    Random random(14);
    const auto table = CollisionShape::ofTriangles(meshOf(shapes::box(Vec3d(9, 9, 1))));
    const auto ball = CollisionShape::ofTriangles(bumpy(random, 12, 18));
    const Affine3d here = Affine3d::Identity();
    const Affine3d world = composeTransform(Vec3d(0.1, 0.2, 1.2), Quatd::Identity(), Vec3d::Ones());
    const std::vector<FacePair> faces = contactsBetween({*table, here}, {*ball, world});
    ASSERT_GT(faces.size(), 10u);
    const ContactRegions regions = regionsOf({*table, here}, {*ball, world}, faces);
    ASSERT_EQ(regions.regionOf.size(), faces.size());
    for (const std::uint32_t region : regions.regionOf) {
        ASSERT_NE(region, ContactRegions::kNone);
        EXPECT_GT(regions.regions[region].normal.z(), 0.999);
    }
}

TEST(PairContact, PlacesOnFacesAreThoseOfThePoint) {
    Random random(15);
    const auto a = CollisionShape::ofTriangles(bumpy(random, 6, 9)),
               b = CollisionShape::ofTriangles(strewn(random, 80, 0.5));
    std::size_t seen = 0;
    for (const NamedMap& map : everyKindOfMap(random)) {
        const Affine3d worldA = composeTransform(inCube(random, 0.3), anyRotation(random), Vec3d(1, -1, 1));
        const PlacedShape placedA{*a, worldA}, placedB{*b, map.map};
        if (!invertible(map.map)) continue;
        const double extent = map.map.matrix().cwiseAbs().maxCoeff() + 2;
        for (const FacePair& faces : contactsBetween(placedA, placedB)) {
            ++seen;
            const PairContact found = contactOfFaces(placedA, placedB, faces);
            const auto at = [](const PlacedShape& of, std::uint32_t face, const Vec2d& uv) {
                const Triangle t = transformed(of.world, of.shape.mesh().triangle(face));
                return Vec3d(t[0] + uv.x() * (t[1] - t[0]) + uv.y() * (t[2] - t[0]));
            };
            ASSERT_LT((at(placedA, faces.a, found.uvA) - found.point).norm(), 1e-9 * extent) << map.name;
            ASSERT_LT((at(placedB, faces.b, found.uvB) - found.point).norm(), 1e-9 * extent) << map.name;
            ASSERT_NEAR(found.normal.norm(), 1, 1e-12);
            for (const Vec2d& uv : {found.uvA, found.uvB})
                ASSERT_TRUE(uv.x() >= 0 && uv.y() >= 0 && uv.sum() <= 1 + 1e-15);
        }
    }
    EXPECT_GT(seen, 200u);
}

/// Hills over a grid, with or without missing cells.
TriangleMesh hills(Random& random, std::uint32_t n, bool holes = true) {
    shapes::Soup soup;
    for (std::uint32_t row = 0; row <= n; ++row)
        for (std::uint32_t column = 0; column <= n; ++column)
            soup.vertex(Vec3d(4.0 * column / n - 2, between(random, -0.3, 0.3), 4.0 * row / n - 2));
    for (std::uint32_t row = 0; row < n; ++row)
        for (std::uint32_t column = 0; column < n; ++column) {
            const std::uint32_t at = row * (n + 1) + column;
            if (!holes || random() % 10 != 0) soup.indices.insert(soup.indices.end(), {at, at + n + 1, at + 1});
            if (!holes || random() % 10 != 0) soup.indices.insert(soup.indices.end(), {at + 1, at + n + 1, at + n + 2});
        }
    return meshOf(soup);
}

TEST(PairTable, AHeightFieldAnswersAsItsTriangles) {
    Random random(18);
    std::size_t met = 0;
    for (int round = 0; round < 5; ++round) {
        const TriangleMesh ground = hills(random, 20), thing = bumpy(random, 6, 9), rough = hills(random, 9);
        const auto field = CollisionShape::ofHeightField(ground);
        ASSERT_TRUE(field) << field.error().message;
        const auto surface = CollisionShape::ofTriangles(ground);
        const auto ball = CollisionShape::ofTriangles(thing), hull = CollisionShape::ofHull(thing),
                   plain = CollisionShape::ofTriangles(rough);
        const auto small = *CollisionShape::ofHeightField(rough);
        for (const NamedMap& map : everyKindOfMap(random)) {
            if (!invertible(map.map)) continue;
            const Affine3d here = composeTransform(inCube(random, 0.5), anyRotation(random), Vec3d::Ones());
            for (const auto& [other, same] : {std::pair(ball, ball), std::pair(hull, hull), std::pair(small, plain)}) {
                const PlacedShape a{**field, here}, b{*other, map.map}, triangles{*surface, here},
                    bTriangles{*same, map.map};
                QueryWork work;
                const PairTouch found = contactsOf(a, b, kAll, {work}),
                                truth = contactsOf(triangles, bTriangles, kAll, {work});
                ASSERT_EQ(found.faces, truth.faces) << round << " " << map.name;
                ASSERT_EQ(found.touch, truth.touch);
                ASSERT_EQ(touchOf(b, a, {work}).touch, truth.touch);
                ASSERT_NEAR(distanceInWorld(a, b, {}, work).distance,
                            distanceInWorld(triangles, bTriangles, {}, work).distance,
                            1e-12 * map.map.matrix().cwiseAbs().maxCoeff());
                ASSERT_EQ(pairMethods(**field, *other).byTrees, kNoQuestion);
                met += truth.touch == Touch::kYes;
                const BodyMotion still{.start = Pose{}, .end = Pose{}, .body_T_mesh = here};
                BodyMotion falls{.start = Pose{}, .end = Pose{}, .body_T_mesh = map.map};
                falls.end.translation = inCube(random, 3);
                const ImpactOptions options{.tolerance = 1e-5};
                const Impact hit =
                    pairMethods(**field, *other).firstContact(**field, still, *other, falls, work, options);
                const Impact sure =
                    pairMethods(*surface, *same).firstContact(*surface, still, *same, falls, work, options);
                ASSERT_TRUE(hit.complete && sure.complete);
                if (hit.hit && sure.hit)
                    ASSERT_NEAR(hit.t, sure.t, 1e-2) << map.name;  // grazing: within the tolerance either may be first
                else
                    ASSERT_EQ(hit.hit, sure.hit) << map.name;
            }
        }
    }
    EXPECT_GT(met, 20u);
}

TEST(CollisionShape, AHeightFieldOfMoreFacesThanAMeshHasCornersForIsNone) {
    Random random(19);
    const TriangleMesh ground = hills(random, 20, false);
    const std::size_t corners = 3 * ground.faceCount();
    EXPECT_TRUE(CollisionShape::ofHeightField(ground, {}, {.maxVertices = corners}));
    const auto larger = CollisionShape::ofHeightField(ground, {}, {.maxVertices = corners - 1});
    ASSERT_FALSE(larger);
    EXPECT_EQ(larger.error().code, ErrorCode::kLimit);
}

TEST(CollisionShape, AHeightFieldIsMuchSmallerThanItsTree) {
    Random random(19);
    const TriangleMesh ground = hills(random, 100, false);
    const auto field = *CollisionShape::ofHeightField(ground);
    const auto surface = CollisionShape::ofTriangles(ground);
    (void)surface->tree();
    EXPECT_LT(10 * field->memoryBytes(), surface->memoryBytes());
    EXPECT_EQ(field->bounds().lower, surface->bounds().lower);
    for (std::uint32_t face = 0; face < field->faceCount(); ++face)
        ASSERT_EQ(field->triangle(face), surface->triangle(face));
    EXPECT_EQ(field->mesh().faceCount(), surface->faceCount()) << "and it can be had as triangles";
    EXPECT_FALSE(CollisionShape::ofHeightField(bumpy(random, 5, 6)));
}

TEST(CollisionShape, TreesAreMadeWhenFirstAskedForByWhoeverAsks) {
    Random random(16);
    const auto shape = CollisionShape::ofTriangles(bumpy(random, 40, 60), {.volume = VolumeKind::kDop18});
    const std::size_t bare = shape->memoryBytes();
    EXPECT_EQ(bare, shape->mesh().memoryBytes());
    std::array<const TriangleTree*, 8> seen{};
    std::vector<std::thread> threads;
    for (const TriangleTree*& tree : seen) threads.emplace_back([&] { tree = &shape->tree(); });
    for (std::thread& thread : threads) thread.join();
    for (const TriangleTree* tree : seen) EXPECT_EQ(tree, seen[0]);
    EXPECT_EQ(seen[0]->options().volume, VolumeKind::kDop18);
    EXPECT_EQ(&seen[0]->mesh(), &shape->mesh()) << "one mesh for all";
    const std::size_t one = shape->memoryBytes();
    EXPECT_GT(one, bare);
    (void)shape->tree(VolumeKind::kObb);
    EXPECT_GT(shape->memoryBytes(), one);
}

TEST(CollisionShape, AllTreesFollowADeformation) {
    Random random(17);
    const auto shape = CollisionShape::ofTriangles(bumpy(random, 9, 12), {.volume = VolumeKind::kAabb});
    shape->setDeforms();
    const auto other = CollisionShape::ofTriangles(strewn(random, 400, 0.5), {.volume = VolumeKind::kObb});
    EXPECT_EQ(commonVolume(*shape, *other), VolumeKind::kAabb) << "what deforms is cheap to refit";
    const Affine3d here = Affine3d::Identity();
    for (const VolumeKind kind : kVolumes) (void)shape->tree(kind);
    for (int step = 0; step < 5; ++step) {
        std::vector<Vec3d> positions;
        for (const Vec3d p : shape->mesh().positions()) positions.push_back(p + inCube(random, 0.2));
        ASSERT_TRUE(shape->move(positions));
        const std::vector<FacePair> truth = bruteForceOf({*shape, here}, {*other, here});
        ASSERT_FALSE(truth.empty());
        for (const VolumeKind kind : kVolumes) {
            QueryWork work;
            FacePairs found = allTouching(other->tree(kind), shape->tree(kind), here, work);
            for (FacePair& faces : found.pairs) std::swap(faces.a, faces.b);
            std::ranges::sort(found.pairs);
            EXPECT_EQ(found.pairs, truth);
        }
    }
    std::vector<Vec3d> bad(shape->mesh().vertexCount(), Vec3d::Constant(std::nan("")));
    EXPECT_FALSE(shape->move(bad));
}

}  // namespace
}  // namespace tessera
