// First contacts with height fields: never late, never missed, and those of trees to within the tolerance.
#include <gtest/gtest.h>

#include <limits>

#include "server/collision/representation/HeightFieldQueries.h"
#include "tests/unit/motion/Bodies.h"
#include "tests/unit/representation/Terrains.h"

namespace tessera {
namespace {

using namespace terrains;

struct FieldAndTree {
    TriangleMesh mesh;
    TriangleTree tree;
    HeightField field;

    explicit FieldAndTree(const TriangleMesh& of) : mesh(of), tree(of), field(*HeightField::recognise(of)) {}
};

Vec3d direction(Random& random) {
    std::normal_distribution<double> n;
    return Vec3d(n(random), n(random), n(random)).normalized();
}
Quatd anyTurn(Random& random) {
    std::normal_distribution<double> n;
    return Quatd(n(random), n(random), n(random), n(random)).normalized();
}

/// Past or into something about the origin.
BodyMotion anyMotion(Random& random, unsigned kind) {
    BodyMotion m;
    const Vec3d d = direction(random);
    m.start.translation = 2.2 * d;
    m.end.translation = -1.2 * d + direction(random);
    m.start.rotation = anyTurn(random);
    m.end.rotation = kind % 3 == 0
                         ? m.start.rotation
                         : Quatd(Eigen::AngleAxisd(between(random, -1.5, 1.5), direction(random))) * m.start.rotation;
    if (kind % 5 == 1)
        m.end.scale = Vec3d(between(random, 0.5, 1.5), between(random, 0.5, 1.5), between(random, -0.5, 1.5));
    if (kind % 5 == 2) m.body_T_mesh.linear()(0, 1) = between(random, -0.5, 0.5);
    if (kind % 7 == 3) m.body_T_mesh.linear().col(2).setZero();
    return m;
}

template <typename A, typename B>
Impact impactOf(const A& a, const BodyMotion& ma, const B& b, const BodyMotion& mb, double tolerance) {
    QueryWork work;
    return timeOfImpact(a, ma, b, mb, work, {.tolerance = tolerance});
}

void expectRight(const Impact& found, const Impact& beside, const TriangleMesh& a, const BodyMotion& ma,
                 const TriangleMesh& b, const BodyMotion& mb, double tolerance, const std::string& story) {
    ASSERT_TRUE(found.complete) << story;
    for (int s = 0; s <= 40; ++s) {
        const double t = s / 40.0;
        if (found.hit && t >= found.t) break;
        ASSERT_FALSE(bodies::touching(bodies::facesOf(a, ma.placeAt(t)), bodies::facesOf(b, mb.placeAt(t))))
            << story << ", t = " << t;
    }
    // What only comes within the tolerance may be a hit for one of them alone.
    if (found.hit != beside.hit) {
        ASSERT_GT((found.hit ? found : beside).distance, 0) << story;
        return;
    }
    if (!found.hit) return;
    ASSERT_NEAR(found.t, beside.t, 1e-3) << story;
    const double distance =
        bodies::distance(bodies::facesOf(a, ma.placeAt(found.t)), bodies::facesOf(b, mb.placeAt(found.t)));
    ASSERT_LE(distance, tolerance) << story;
    ASSERT_NEAR(found.distance, distance, 1e-12) << story;
    ASSERT_NEAR(found.normal.norm(), 1, 1e-9) << story;
}

TEST(HeightFieldImpact, IsNeverMissedNeverLateAndThatOfTheTree) {
    int hits = 0;
    constexpr int kTrials = 150;
    for (int i = 0; i < kTrials; ++i) {
        const auto seed = static_cast<std::uint64_t>(i + 1);
        const std::string story = "seed " + std::to_string(seed);
        Random random(seed);
        Terrain terrain = anyTerrain(random), small = anyTerrain(random);
        terrain.columns = 2 + terrain.columns % 9, terrain.rows = 2 + terrain.rows % 7;
        small.columns = 2 + small.columns % 4, small.rows = 2 + small.rows % 4;
        const FieldAndTree land(make(random, terrain).mesh()), other(make(random, small).mesh());
        std::mt19937 soups(static_cast<unsigned>(seed));
        const TriangleTree body(i % 2 ? bodies::soup(soups, 12).mesh() : bodies::sphere(0.4, 4, 6).mesh(),
                                {.volume = static_cast<VolumeKind>(i % 7)});
        const BodyMotion mb = anyMotion(random, static_cast<unsigned>(i));
        const BodyMotion ma = i % 4 == 3 ? anyMotion(random, 4) : BodyMotion{};
        const double tolerance = i % 3 ? 1e-4 : 1e-8;
        const Impact found = impactOf(land.field, ma, body, mb, tolerance);
        hits += found.hit;
        expectRight(found, impactOf(land.tree, ma, body, mb, tolerance), land.mesh, ma, body.mesh(), mb, tolerance,
                    story);
        expectRight(impactOf(body, mb, land.field, ma, tolerance), impactOf(body, mb, land.tree, ma, tolerance),
                    body.mesh(), mb, land.mesh, ma, tolerance, story + ", B");
        expectRight(impactOf(land.field, ma, other.field, mb, tolerance),
                    impactOf(land.tree, ma, other.tree, mb, tolerance), land.mesh, ma, other.mesh, mb, tolerance,
                    story + ", fields");
        if (testing::Test::HasFatalFailure()) return;
    }
    EXPECT_GT(hits, kTrials / 4);
    EXPECT_LT(hits, kTrials);
}

/// A box that stands on a terrain's flat part goes along it up to the slope; pairs that are left out are.
TEST(HeightFieldImpact, HonoursSupportsWithinAndMargin) {
    Random random(1);
    const Terrain ramp{.columns = 41, .rows = 5, .width = 20, .depth = 8, .height = [](double x, double) {
                           return std::max(0.0, x - 3);
                       }};
    const FieldAndTree land(make(random, ramp).mesh());
    const bodies::Body box = bodies::box(Vec3d::Ones());
    const std::vector<Support> supports{{.normal = Vec3d::UnitZ(), .overlap = 1e-4, .rounding = 1e-10}};
    BodyMotion way;
    way.start.translation = Vec3d(0, 0.1, 0.5), way.end.translation = Vec3d(5, 0.1, 0.5);
    QueryWork work;
    EXPECT_EQ(timeOfImpact(land.field, {}, box.tree(), way, work).t, 0) << "touches at the start";
    const Impact along = timeOfImpact(land.field, {}, box.tree(), way, work, {.tolerance = 1e-9, .supports = supports});
    ASSERT_TRUE(along.hit);
    EXPECT_NEAR(along.t, 0.5, 1e-8);
    EXPECT_LE(along.t, 0.5);
    const BodyMotion lower{{Vec3d(0, 0.1, 0.2), Quatd::Identity(), Vec3d::Ones()},
                           {Vec3d(0, 0.1, 0.201), Quatd::Identity(), Vec3d::Ones()}};
    const FacePairs stuck = allTouching(land.field, box.tree(), lower.placeAt(0), work);
    ASSERT_FALSE(stuck.pairs.empty());
    EXPECT_TRUE(timeOfImpact(land.field, {}, box.tree(), lower, work).hit);
    EXPECT_FALSE(timeOfImpact(land.field, {}, box.tree(), lower, work, {.within = stuck.pairs}).hit) << "pulled";
    BodyMotion falling;
    falling.start.translation = Vec3d(0, 0.1, 2.5), falling.end.translation = Vec3d(0, 0.1, 0.5);
    const Impact early = timeOfImpact(land.field, {}, box.tree(), falling, work, {.tolerance = 1e-9, .margin = 1});
    EXPECT_NEAR(early.t, 0.5, 1e-8);
    EXPECT_LE(early.t, 0.5);
}

TEST(HeightFieldImpact, BadInputAndExhaustedWorkAreUnknown) {
    Random random(2);
    const FieldAndTree land(make(random, {}).mesh());
    const bodies::Body box = bodies::box(Vec3d::Constant(0.3));
    BodyMotion way;
    way.start.translation = Vec3d(0, 0, 2), way.end.translation = Vec3d(0, 0, -2);
    BodyMotion bad = way;
    bad.end.translation.x() = std::numeric_limits<double>::quiet_NaN();
    QueryWork work;
    EXPECT_FALSE(timeOfImpact(land.field, {}, box.tree(), bad, work).complete);
    EXPECT_EQ(timeOfImpact(land.field, bad, box.tree(), way, work).t, 0);
    const double truth = timeOfImpact(land.field, {}, box.tree(), way, work).t;
    for (const std::uint64_t limit : {0U, 1U, 3U}) {
        QueryWork few{.limit = limit};
        const Impact found = timeOfImpact(land.field, {}, box.tree(), way, few);
        EXPECT_FALSE(found.complete || found.hit) << limit;
        EXPECT_LE(found.t, truth) << limit;
    }
}

/// Cloth over a terrain, at rest or deforming, beside the tree's answer.
TEST(HeightFieldImpact, BetweenTwoStatesIsThatOfTheTree) {
    int hits = 0;
    for (std::uint64_t seed = 1; seed <= 60; ++seed) {
        Random random(seed);
        const FieldAndTree land(make(random, anyTerrain(random)).mesh());
        Terrain sheet{.columns = 6, .rows = 5, .width = 0.8, .depth = 0.8};
        const TriangleTree cloth(make(random, sheet).mesh());
        std::vector<Vec3d> clothEnd, landEnd;
        const Vec3d by = 1.5 * direction(random);
        for (const Vec3d& p : cloth.mesh().positions()) clothEnd.push_back(p + by + 0.1 * direction(random));
        for (const Vec3d& p : land.mesh.positions())
            landEnd.push_back(seed % 2 ? p : Vec3d(p + 0.2 * direction(random)));
        const Affine3d away(Eigen::Translation3d(-0.7 * by));
        std::vector<Vec3d> start;
        for (const Vec3d& p : cloth.mesh().positions()) start.push_back(away * p);
        TriangleTree moved(cloth.mesh());
        ASSERT_TRUE(moved.refit(start));
        QueryWork work, trees;
        const std::span<const Vec3d> fieldEnd = seed % 2 ? std::span<const Vec3d>{} : landEnd;
        const Impact is = timeOfImpact(land.field, fieldEnd, moved, clothEnd, work),
                     was = timeOfImpact(land.tree, landEnd, moved, clothEnd, trees);
        const Impact turned = timeOfImpact(moved, clothEnd, land.field, fieldEnd, work);
        for (const Impact& one : {is, turned}) {
            ASSERT_TRUE(one.complete);
            if (one.hit != was.hit) {
                EXPECT_GT((one.hit ? one : was).distance, 0) << "seed " << seed;
                continue;
            }
            if (!one.hit) continue;
            EXPECT_NEAR(one.t, was.t, 1e-3) << "seed " << seed;
            EXPECT_LE(one.distance, 1e-4) << "seed " << seed;
        }
        if (is.hit) {
            ++hits;
            EXPECT_LT(is.faces.a, land.mesh.faceCount());
            const auto at = [&](const Vec3d& from, const Vec3d& to) -> Vec3d { return (1 - is.t) * from + is.t * to; };
            Triangle a, b;
            for (unsigned k = 0; k < 3; ++k) {
                a[k] = at(land.mesh.corner(is.faces.a, k), landEnd[land.mesh.vertexOf(is.faces.a, k)]);
                b[k] = at(moved.mesh().corner(is.faces.b, k), clothEnd[moved.mesh().vertexOf(is.faces.b, k)]);
            }
            EXPECT_NEAR(trianglesIntersect(a, b) ? 0 : nearestPoints(a, b).distance, is.distance, 1e-9)
                << "seed " << seed;
        }
    }
    EXPECT_GT(hits, 15);
    Random random(1);
    const FieldAndTree land(make(random, {}).mesh());
    const TriangleTree cloth(make(random, {.columns = 3, .rows = 3}).mesh());
    QueryWork work;
    EXPECT_FALSE(timeOfImpact(land.field, {}, cloth, std::vector<Vec3d>(8, Vec3d::Zero()), work).complete);
    EXPECT_FALSE(timeOfImpact(land.field, std::vector<Vec3d>(3, Vec3d::Zero()), cloth,
                              std::vector<Vec3d>(9, Vec3d::Zero()), work)
                     .complete);
}

/// Short ways over a large terrain, as a frame's are, beside the tree's counters: as many boxes, and twice the steps.
TEST(HeightFieldImpact, ShortWaysCostThreeTimesThoseOfTheTreeAtMost) {
    Random random(6);
    const Terrain hills{.columns = 257, .rows = 257, .width = 256, .depth = 256, .height = [](double x, double y) {
                            return 2 * std::sin(0.3 * x) * std::cos(0.2 * y);
                        }};
    const FieldAndTree land(make(random, hills).mesh());
    const bodies::Body ball = bodies::sphere(0.7, 8, 10);
    QueryWork field, tree;
    int hits = 0;
    for (int i = 0; i < 300; ++i) {
        BodyMotion way;
        way.start.translation = Vec3d(between(random, -100, 100), between(random, -100, 100), between(random, 0, 4));
        way.end.translation = way.start.translation + 1.5 * direction(random);
        way.start.rotation = anyTurn(random), way.end.rotation = anyTurn(random);
        const Impact is = timeOfImpact(land.field, {}, ball.tree(), way, field),
                     was = timeOfImpact(land.tree, {}, ball.tree(), way, tree);
        ASSERT_EQ(is.hit, was.hit) << i;
        // (Either is where the distance is 1e-4 at most, which who comes in flat takes a while to cross.)
        ASSERT_NEAR(is.t, was.t, 1e-3) << i;
        hits += is.hit;
    }
    std::printf("%d hits: %llu + %llu, of the tree %llu + %llu\n", hits,
                static_cast<unsigned long long>(field.boxTests), static_cast<unsigned long long>(field.triangleTests),
                static_cast<unsigned long long>(tree.boxTests), static_cast<unsigned long long>(tree.triangleTests));
    EXPECT_LT(field.boxTests, 2 * tree.boxTests);
    EXPECT_LT(field.boxTests + field.triangleTests, 3 * (tree.boxTests + tree.triangleTests));
}

}  // namespace
}  // namespace tessera
