// Queries of height fields beside brute force and beside those of trees over the same meshes.
#include "common/math/Compose.h"
#include "server/collision/representation/HeightFieldQueries.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/unit/query/Bodies.h"
#include "tests/unit/representation/Terrains.h"

namespace tessera {
namespace {

using namespace terrains;

std::string seedOf(std::uint64_t seed) {
    return "seed " + std::to_string(seed);
}

/// A terrain as mesh, tree and field.
struct Land {
    TriangleMesh mesh;
    TriangleTree tree;
    HeightField field;

    explicit Land(const TriangleMesh& of) : mesh(of), tree(of), field(*HeightField::recognise(of)) {}
};

Land anyLand(Random& random) {
    return Land(make(random, anyTerrain(random)).mesh());
}

TriangleMesh anyBody(Random& random) {
    switch (random() % 3) {
        case 0:
            return bodies::bumpy(random, 5, 7);
        case 1:
            return bodies::strewn(random, 60, between(random, 0.05, 1.5));
        default:
            return make(random, anyTerrain(random)).mesh();
    }
}

/// Of bodies of about size 2, mostly near each other's surfaces.
std::vector<bodies::NamedMap> maps(Random& random) {
    std::vector<bodies::NamedMap> out = bodies::everyKindOfMap(random);
    for (int i = 0; i < 6; ++i)
        out.push_back({"small", composeTransform(bodies::inCube(random, 1), bodies::anyRotation(random),
                                                 Vec3d::Constant(between(random, 0.02, 0.3)))});
    for (int i = 0; i < 3; ++i)
        out.push_back({"large", composeTransform(bodies::inCube(random, 4), bodies::anyRotation(random),
                                                 Vec3d::Constant(between(random, 5, 30)))});
    out.push_back(
        {"nearly flat", composeTransform(bodies::inCube(random, 0.3), bodies::anyRotation(random), Vec3d(1, 1e-9, 1))});
    out.push_back({"moved by a cell", Affine3d(Eigen::Translation3d(bodies::inCube(random, 0.4)))});
    return out;
}

template <typename A, typename B>
void expectTouching(const A& a, const B& b, const Affine3d& a_T_b, const std::vector<FacePair>& truth,
                    const std::string& story) {
    QueryWork work;
    const FacePairs all = allTouching(a, b, a_T_b, work);
    EXPECT_TRUE(all.complete) << story;
    EXPECT_EQ(all.pairs, truth) << story;
    const TouchedPair first = firstTouching(a, b, a_T_b, work);
    EXPECT_EQ(first.touch, truth.empty() ? Touch::kNo : Touch::kYes) << story;
    EXPECT_TRUE(truth.empty() || std::ranges::binary_search(truth, first.faces)) << story;
    EXPECT_GT(work.boxTests, 0u) << story;
}

TEST(HeightFieldTouching, FindsWhatBruteForceFindsUnderEveryMap) {
    std::size_t pairs = 0;
    for (std::uint64_t seed = 1; seed <= 40; ++seed) {
        Random random(seed);
        const Land land = anyLand(random), other = anyLand(random);
        const TriangleMesh body = anyBody(random);
        const TriangleTree tree(body, {.volume = bodies::kVolumes[seed % 7]});
        for (const bodies::NamedMap& m : maps(random)) {
            const std::string story = seedOf(seed) + ", " + m.name;
            const std::vector<FacePair> truth = bruteForce(land.mesh, body, m.map);
            expectTouching(land.field, tree, m.map, truth, story);
            expectTouching(tree, land.field, m.map, bruteForce(body, land.mesh, m.map), story + ", B");
            expectTouching(land.field, other.field, m.map, bruteForce(land.mesh, other.mesh, m.map),
                           story + ", fields");
            pairs += truth.size();
        }
    }
    EXPECT_GT(pairs, 10'000u);
}

/// Bodies on integer coordinates over a stepped grid: whatever touches does so exactly.
TEST(HeightFieldTouching, TouchingExactlyCounts) {
    std::size_t pairs = 0;
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        Random random(seed);
        Terrain steps{.columns = 9, .rows = 9, .width = 8, .depth = 8};
        steps.height = [&](double, double) { return static_cast<double>(random() % 3); };
        steps.heightAxis = static_cast<int>(seed % 3);
        steps.diagonals = 3;
        const Land land(make(random, steps).mesh());
        const auto whole = [&] { return static_cast<float>(static_cast<int>(random() % 9) - 4); };
        shapes::Soup soup;
        for (int i = 0; i < 120; ++i) {
            soup.vertex(Vec3d(whole(), whole(), whole()));
            soup.indices.push_back(static_cast<std::uint32_t>(i));
        }
        const TriangleTree tree(bodies::meshOf(soup));
        for (const double shift : {0.0, 1.0}) {
            const Affine3d map(Eigen::Translation3d(Vec3d::Constant(shift)));
            const std::vector<FacePair> truth = bruteForce(land.mesh, tree.mesh(), map);
            expectTouching(land.field, tree, map, truth, seedOf(seed));
            expectTouching(tree, land.field, map, bruteForce(tree.mesh(), land.mesh, map), seedOf(seed));
            expectTouching(land.field, land.field, map, bruteForce(land.mesh, land.mesh, map), seedOf(seed));
            pairs += truth.size();
        }
    }
    EXPECT_GT(pairs, 1'000u);
}

TEST(HeightFieldTouching, TinyAndHugeCoordinatesAreNoMatter) {
    for (const double unit : {1e-30, 1e-12, 1e9, 1e30})
        for (std::uint64_t seed = 1; seed <= 4; ++seed) {
            Random random(seed);
            Terrain terrain = anyTerrain(random);
            terrain.asFloats = false;
            Grid grid = make(random, terrain);
            for (double& x : grid.positions) x = unit * x + (seed % 2 ? 0 : 3 * unit);
            const Land land(grid.mesh());
            const TriangleMesh body = bodies::bumpy(random, 5, 7);
            const TriangleTree tree(body);
            const Affine3d map = composeTransform(unit * bodies::inCube(random, 0.5), bodies::anyRotation(random),
                                                  Vec3d::Constant(0.4 * unit));
            const std::string story = seedOf(seed) + ", unit " + std::to_string(unit);
            expectTouching(land.field, tree, map, bruteForce(land.mesh, body, map), story);
            const Affine3d back = map.inverse();
            expectTouching(tree, land.field, back, bruteForce(body, land.mesh, back), story);
        }
}

template <typename A, typename B>
void expectContactsAndDistanceOf(const A& a, const B& b, const TriangleTree& treeA, const TriangleTree& treeB,
                                 const Affine3d& a_T_b, bool unique, const std::string& story) {
    QueryWork work, trees;
    const BodyContacts is = contactsBetween(a, b, a_T_b, work), was = contactsBetween(treeA, treeB, a_T_b, trees);
    ASSERT_EQ(is.contacts.size(), was.contacts.size()) << story;
    for (std::size_t i = 0; i < is.contacts.size(); ++i) {
        ASSERT_EQ(is.contacts[i].faces, was.contacts[i].faces) << story;
        ASSERT_EQ(is.contacts[i].contact.point, was.contacts[i].contact.point) << story;
        ASSERT_EQ(is.contacts[i].contact.normal, was.contacts[i].contact.normal) << story;
    }
    if (is.contacts.size() > 1) {
        const BodyContacts few = contactsBetween(a, b, a_T_b, work, 1);
        ASSERT_EQ(few.contacts.size(), 1u);
        EXPECT_FALSE(few.complete);
        EXPECT_EQ(few.contacts[0].faces, was.contacts[0].faces);
    }
    const Distance d = distanceBetween(a, b, a_T_b, work), truth = distanceBetween(treeA, treeB, a_T_b, trees);
    ASSERT_TRUE(d.complete && truth.complete) << story;
    ASSERT_EQ(d.distance, truth.distance) << story;
    if (d.distance == 0) return;
    if (unique) {
        EXPECT_EQ(d.faces, truth.faces) << story;
        EXPECT_EQ(d.onA, truth.onA) << story;
        EXPECT_EQ(d.onB, truth.onB) << story;
    }
    // Bounds and hints.
    EXPECT_TRUE(distanceBetween(a, b, a_T_b, work, {.upperBound = 0.5 * d.distance}).farther) << story;
    EXPECT_EQ(distanceBetween(a, b, a_T_b, work, {.upperBound = 0.5 * d.distance}).distance, 0.5 * d.distance) << story;
    EXPECT_EQ(distanceBetween(a, b, a_T_b, work, {.upperBound = 2 * d.distance}).distance, d.distance) << story;
    QueryWork warm;
    EXPECT_EQ(distanceBetween(a, b, a_T_b, warm, {.start = d.faces}).distance, d.distance) << story;
    const double loose = distanceBetween(a, b, a_T_b, work, {.tolerance = 0.1 * d.distance}).distance;
    EXPECT_GE(loose, d.distance) << story;
    EXPECT_LE(loose, 1.1 * d.distance) << story;
}

TEST(HeightFieldDistance, AndContactsAreThoseOfTheTreeToTheBit) {
    int apart = 0;
    for (std::uint64_t seed = 1; seed <= 14; ++seed) {
        Random random(seed);
        Terrain rough = anyTerrain(random);
        const bool unique = seed % 2;
        if (unique)
            rough.height = [&](double x, double y) { return 0.3 * std::sin(4 * x + y) + between(random, 0, 0.1); };
        const Land land(make(random, rough).mesh()), other = anyLand(random);
        const TriangleTree tree(bodies::bumpy(random, 6, 8));
        std::vector<bodies::NamedMap> poses = maps(random);
        for (int i = 0; i < 8; ++i)
            poses.push_back({"above", composeTransform(bodies::inCube(random, 2.5), bodies::anyRotation(random),
                                                       Vec3d::Constant(between(random, 0.1, 1)))});
        for (const bodies::NamedMap& m : poses) {
            const std::string story = seedOf(seed) + ", " + m.name;
            // Trees look at every pair of faces.
            if (seed > 2 && m.map.linear().norm() > 1e4) continue;
            // Of a flattened body many faces are equally near.
            const bool one = unique && std::string(m.name) == "above";
            expectContactsAndDistanceOf(land.field, tree, land.tree, tree, m.map, one, story);
            expectContactsAndDistanceOf(tree, land.field, tree, land.tree, m.map, one, story + ", B");
            expectContactsAndDistanceOf(land.field, other.field, land.tree, other.tree, m.map, false,
                                        story + ", fields");
            QueryWork work;
            apart += distanceBetween(land.field, tree, m.map, work).distance > 0;
        }
    }
    EXPECT_GT(apart, 60);
}

TEST(HeightFieldQueries, GiveUpWhereToldToAndSaySo) {
    Random random(3);
    Terrain hills{.columns = 60, .rows = 60, .height = [](double x, double y) {
                      return 0.2 * std::sin(9 * x) * std::cos(7 * y);
                  }};
    const Land land(make(random, hills).mesh());
    const TriangleTree ball(bodies::bumpy(random, 12, 16));
    const Affine3d through = composeTransform(Vec3d(0.1, 0, 0.3), Quatd::Identity(), Vec3d::Constant(0.5));
    const Affine3d above = composeTransform(Vec3d(0.1, 0, 1.2), Quatd::Identity(), Vec3d::Constant(0.5));
    const std::vector<FacePair> truth = bruteForce(land.mesh, ball.mesh(), through);
    QueryWork whole, far;
    (void)allTouching(land.field, ball, through, whole);
    const double distance = distanceBetween(land.field, ball, above, far).distance;
    const auto sum = [](const QueryWork& work) { return work.boxTests + work.triangleTests; };
    double least = -1;
    for (std::uint64_t limit = 0; limit < sum(whole); limit = limit * 3 / 2 + 1) {
        QueryWork work{.limit = limit};
        const FacePairs found = allTouching(land.field, ball, through, work);
        EXPECT_FALSE(found.complete) << limit;
        EXPECT_TRUE(std::ranges::includes(truth, found.pairs)) << limit;
        EXPECT_LE(sum(work), limit + 200) << limit;
        work = {.limit = limit};
        EXPECT_NE(firstTouching(land.field, ball, through, work).touch, Touch::kNo) << limit;
        work = {.limit = limit};
        std::vector<std::uint32_t> faces{7};
        Box box;
        box.lower = Vec3d::Constant(-0.9), box.upper = Vec3d::Constant(0.9);
        if (!facesNear(land.field, box, work, faces)) {
            EXPECT_EQ(faces, std::vector<std::uint32_t>{7});
        }
    }
    for (std::uint64_t limit = 0; limit < sum(far); limit = limit * 3 / 2 + 1) {
        QueryWork work{.limit = limit};
        const Distance found = distanceBetween(land.field, ball, above, work);
        EXPECT_FALSE(found.complete && !found.farther && found.distance != distance) << limit;
        EXPECT_LE(found.distance, distance) << limit;
        if (!found.complete) least = std::max(least, found.distance);
    }
    EXPECT_GT(least, 0) << "a bound that is always 0 says nothing";
}

TEST(HeightFieldQueries, EmptyBodiesMeetNothing) {
    Random random(4);
    const Land land = anyLand(random);
    const TriangleTree none{TriangleMesh{}};
    QueryWork work;
    EXPECT_EQ(firstTouching(land.field, none, Affine3d::Identity(), work).touch, Touch::kNo);
    EXPECT_TRUE(allTouching(none, land.field, Affine3d::Identity(), work).complete);
    EXPECT_TRUE(distanceBetween(land.field, none, Affine3d::Identity(), work).farther);
    EXPECT_FALSE(timeOfImpact(none, BodyMotion{}, land.field, BodyMotion{}, work).hit);
    EXPECT_TRUE(timeOfImpact(none, BodyMotion{}, land.field, BodyMotion{}, work).complete);
}

TEST(HeightFieldQueries, FacesNearAPlaceAreThoseWhoseBoxesAre) {
    for (std::uint64_t seed = 1; seed <= 60; ++seed) {
        Random random(seed);
        const Land land = anyLand(random);
        for (int i = 0; i < 20; ++i) {
            Box box;
            const Vec3d at = bodies::inCube(random, 1.2),
                        size = bodies::inCube(random, 1).cwiseAbs() * (i % 2 ? 1 : 0.1);
            box.lower = at, box.upper = at + size;
            // Exactly at a vertex, at times.
            if (i % 5 == 0) box.lower = box.upper = land.mesh.positions()[random() % land.mesh.vertexCount()];
            QueryWork work;
            std::vector<std::uint32_t> is{3}, was{3};
            for (std::uint32_t face = 0; face < land.mesh.faceCount(); ++face) {
                Box of;
                for (const Vec3d& p : land.mesh.triangle(face)) of.extend(p);
                if (of.overlaps(box)) was.push_back(face);
            }
            ASSERT_TRUE(facesNear(land.field, box, work, is));
            ASSERT_EQ(is, was) << seedOf(seed);
        }
    }
}

TEST(HeightFieldQueries, RaysMeetWhatTheyMeetInTheTree) {
    int hits = 0;
    for (std::uint64_t seed = 1; seed <= 60; ++seed) {
        Random random(seed);
        const Land land = anyLand(random);
        for (int i = 0; i < 60; ++i) {
            Ray ray{bodies::inCube(random, 2), bodies::inCube(random, 1)};
            if (i % 4 == 0) ray.direction = Vec3d::Unit(i / 4 % 3) * (i % 8 ? 1 : -1);
            if (i % 6 == 0) ray.origin = land.mesh.positions()[random() % land.mesh.vertexCount()] - 2 * ray.direction;
            if (i % 2 == 1)
                ray.direction = land.mesh.positions()[random() % land.mesh.vertexCount()] +
                                bodies::inCube(random, 0.1) - ray.origin;
            const double most = i % 3 ? 1e9 : between(random, 0, 3);
            const std::optional<RayHit> is = castRay(land.field, ray, most), was = castRay(land.tree, ray, most);
            ASSERT_EQ(is.has_value(), was.has_value()) << seedOf(seed) << ", ray " << i;
            if (!is) continue;
            ++hits;
            ASSERT_EQ(is->t, was->t) << seedOf(seed) << ", ray " << i;
            ASSERT_EQ(is->face, was->face) << seedOf(seed) << ", ray " << i;
        }
    }
    EXPECT_GT(hits, 500);
    Random random(1);
    const Land land = anyLand(random);
    int fromAfar = 0;
    for (const double far : {1e3, 1e6, 1e9})
        for (int i = 0; i < 60; ++i) {
            const Vec3d at = land.mesh.positions()[random() % land.mesh.vertexCount()] + bodies::inCube(random, 0.3);
            Ray ray{at + far * bodies::inCube(random, 1), Vec3d::Zero()};
            ray.direction = at - ray.origin;
            const std::optional<RayHit> is = castRay(land.field, ray, 2), was = castRay(land.tree, ray, 2);
            ASSERT_EQ(is.has_value(), was.has_value()) << far << " away, ray " << i;
            if (!is) continue;
            ++fromAfar;
            EXPECT_NEAR(is->t, was->t, 1e-15) << far << " away, ray " << i;
            EXPECT_EQ(is->face, was->face) << far << " away, ray " << i;
        }
    EXPECT_GT(fromAfar, 40);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(castRay(land.field, {Vec3d(nan, 0, 0), Vec3d::UnitX()}, 1));
    EXPECT_FALSE(castRay(land.field, {Vec3d::Zero(), Vec3d::Zero()}, 1));
    EXPECT_FALSE(castRay(land.field, {Vec3d::Zero(), Vec3d::UnitX()}, -1));
}

/// What is small costs as much on a field of a hundred triangles as on one of millions, and less than trees do.
TEST(HeightFieldTouching, SmallThingsCostNoMoreOnLargeFields) {
    Random random(8);
    const TriangleTree body(bodies::bumpy(random, 6, 8));
    std::uint64_t before = 0;
    for (const std::uint32_t lines : {65U, 1025U}) {
        const double width = lines - 1;
        const Terrain hills{
            .columns = lines, .rows = lines, .width = width, .depth = width, .height = [](double x, double y) {
                return 2 * std::sin(0.3 * x) * std::cos(0.2 * y);
            }};
        const Land land(make(random, hills).mesh());
        QueryWork any, anyTree, all, allTree;
        Random again(9);
        for (int i = 0; i < 400; ++i) {
            const Vec3d at(between(again, -20, 20), between(again, -20, 20), between(again, -3, 3));
            const Affine3d map = composeTransform(at, bodies::anyRotation(again), Vec3d::Constant(0.7));
            const FacePairs found = allTouching(land.field, body, map, all);
            ASSERT_EQ(found.pairs, allTouching(land.tree, body, map, allTree).pairs);
            ASSERT_EQ(firstTouching(land.field, body, map, any).touch,
                      firstTouching(land.tree, body, map, anyTree).touch);
        }
        const auto sum = [](const QueryWork& work) { return work.boxTests + work.triangleTests; };
        std::printf(
            "%u lines: any %llu + %llu, of the tree %llu + %llu; all %llu + %llu, of the tree %llu + %llu\n", lines,
            static_cast<unsigned long long>(any.boxTests), static_cast<unsigned long long>(any.triangleTests),
            static_cast<unsigned long long>(anyTree.boxTests), static_cast<unsigned long long>(anyTree.triangleTests),
            static_cast<unsigned long long>(all.boxTests), static_cast<unsigned long long>(all.triangleTests),
            static_cast<unsigned long long>(allTree.boxTests), static_cast<unsigned long long>(allTree.triangleTests));
        EXPECT_LT(sum(any), sum(anyTree));
        EXPECT_LT(sum(all), sum(allTree));
        if (before != 0) {
            EXPECT_LT(sum(all), before * 11 / 10);
        }
        before = sum(all);
    }
}

}  // namespace
}  // namespace tessera
