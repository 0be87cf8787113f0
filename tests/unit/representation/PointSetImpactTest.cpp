// First contacts of moving balls: closed forms, and dense samples before the answer by distances in long double.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "server/collision/query/BodyWay.h"
#include "server/collision/representation/PointSetQueries.h"
#include "tests/unit/motion/Bodies.h"
#include "tests/unit/representation/BallOracle.h"
#include "tests/unit/representation/Terrains.h"

namespace tessera {
namespace {

using oracle::Real;
using terrains::between;
using terrains::Random;

BodyMotion from(const Vec3d& start, const Vec3d& end) {
    return {.start = {.translation = start}, .end = {.translation = end}};
}
PointSet ballAt(const Vec3d& at, double radius) {
    return *PointSet::make(std::span(&at, 1), radius);
}
ConvexHull boxHull(const Vec3d& size) {
    std::vector<Vec3d> corners;
    for (int i = 0; i < 8; ++i)
        corners.emplace_back((i & 1 ? 0.5 : -0.5) * size.x(), (i & 2 ? 0.5 : -0.5) * size.y(),
                             (i & 4 ? 0.5 : -0.5) * size.z());
    return *ConvexHull::make(corners);
}

template <typename A, typename B>
void expectAt(double t, const A& a, const BodyMotion& ma, const B& b, const BodyMotion& mb, const std::string& story) {
    QueryWork work;
    const Impact one = timeOfImpact(a, ma, b, mb, work, {.tolerance = 1e-9}),
                 other = timeOfImpact(b, mb, a, ma, work, {.tolerance = 1e-9});
    for (const Impact& found : {one, other}) {
        ASSERT_TRUE(found.hit) << story;
        EXPECT_LE(found.t, t * (1 + 1e-12)) << story;
        EXPECT_NEAR(found.t, t, 1e-8) << story;
        EXPECT_LE(found.distance, 1e-9) << story;
        EXPECT_NEAR(found.normal.norm(), 1, 1e-12) << story;
    }
    EXPECT_LT((one.normal + other.normal).norm(), 1e-6) << story;
    EXPECT_LT((one.point - other.point).norm(), 1e-6) << story;
}

TEST(BallImpact, IsWhenItShouldBe) {
    const PointSet ball = ballAt({0, 0, 0}, 0.5);
    const bodies::Body sheet = bodies::sheet(4, 4);
    Random random(1);
    const HeightField plain = *HeightField::recognise(terrains::make(random, {}).mesh());
    const ConvexHull box = boxHull({2, 2, 2});
    // 3 - 4 t = 0.5
    const BodyMotion down = from({0.1, 0.2, 3}, {0.1, 0.2, -1});
    expectAt(0.625, sheet.tree(), {}, ball, down, "plate");
    expectAt(0.625, plain, {}, ball, down, "field");
    expectAt(0.625, ballAt({0.1, 0.2, 0}, 0), {}, ball, down, "point");
    expectAt(0.5, ballAt({0.1, 0.2, 0}, 0.5), {}, ball, down, "ball");
    expectAt(0.375, box, {}, ball, down, "box");
    // Along the diagonal of two of the box's sides to their edge: (3 - 4 t) = 0.5 from it.
    const Vec3d d = Vec3d(1, 0, 1).normalized(), edge(1, 0, 1);
    expectAt(0.625, box, {}, ball, from(edge + 3 * d, edge - d), "edge");
    const Vec3d e = Vec3d::Ones().normalized();
    expectAt(0.625, box, {}, ball, from(Vec3d::Ones() + 3 * e, Vec3d::Ones() - e), "corner");
    // Where it is met.
    QueryWork work;
    const Impact at = timeOfImpact(sheet.tree(), {}, ball, down, work, {.tolerance = 1e-9});
    EXPECT_LT((at.point - Vec3d(0.1, 0.2, 0)).norm(), 1e-8);
    EXPECT_LT((at.normal - Vec3d::UnitZ()).norm(), 1e-9);
    EXPECT_FALSE(timeOfImpact(sheet.tree(), {}, ball, from({0.1, 0.2, 3}, {0.1, 0.2, 0.501}), work).hit);
}

TEST(BallImpact, BallsGrowWithTheirBody) {
    const PointSet ball = ballAt({0, 0, 0}, 0.5);
    const bodies::Body sheet = bodies::sheet(9, 9);
    BodyMotion growing;
    growing.start.translation = growing.end.translation = Vec3d(0.1, 0.2, 2);
    growing.end.scale = Vec3d::Constant(7);  // 0.5 + 3 t = 2
    expectAt(0.5, sheet.tree(), {}, ball, growing, "growing");
    growing.start.scale = Vec3d::Constant(3), growing.end.scale = Vec3d::Constant(0.1);
    QueryWork work;
    EXPECT_FALSE(timeOfImpact(sheet.tree(), {}, ball, growing, work).hit) << "shrinks";
    growing.end = growing.start;
    growing.end.translation.z() = 0.5;  // 2 - 1.5 t = 1.5
    growing.body_T_mesh.linear() = Mat3d::Identity() * 1.0;
    expectAt(1.0 / 3, sheet.tree(), {}, ball, growing, "scaled");
    growing.body_T_mesh.linear() = Mat3d::Identity() * -0.5;  // 2 - 1.5 t = 0.75
    expectAt(2.5 / 3, sheet.tree(), {}, ball, growing, "mirrored and scaled in its frame");
    // A margin on top: 2 - 1.5 t = 0.75 + 0.5
    const Impact early = timeOfImpact(sheet.tree(), {}, ball, growing, work, {.tolerance = 1e-9, .margin = 0.5});
    EXPECT_NEAR(early.t, 0.5, 1e-8);
}

TEST(BallImpact, WithinAHullTouchesAtOnce) {
    const ConvexHull box = boxHull({4, 4, 4});
    QueryWork work;
    const PointSet ball = ballAt({0, 0, 0}, 0.25), point = ballAt({0, 0, 0}, 0);
    for (const PointSet* set : {&ball, &point}) {
        const Impact found = timeOfImpact(box, {}, *set, from({1, 0.2, 0.1}, {9, 0, 0}), work);
        ASSERT_TRUE(found.hit);
        EXPECT_EQ(found.t, 0);
        EXPECT_EQ(found.distance, 0);
        EXPECT_LT((found.normal - Vec3d::UnitX()).norm(), 1e-9);
        EXPECT_EQ(found.faces, (FacePair{0, 0}));
        const Impact turned = timeOfImpact(*set, from({1, 0.2, 0.1}, {9, 0, 0}), box, {}, work);
        EXPECT_LT((turned.normal + Vec3d::UnitX()).norm(), 1e-9);
        const std::vector<FacePair> out{{0, 0}};
        EXPECT_FALSE(timeOfImpact(box, {}, *set, from({1, 0.2, 0.1}, {9, 0, 0}), work, {.within = out}).hit)
            << "left out";
    }
    // A hull that is flat, a segment, a point.
    const ConvexHull flat = *ConvexHull::make(std::vector<Vec3d>{{-1, -1, 0}, {1, -1, 0}, {0, 2, 0}});
    expectAt(0.6875, flat, {}, ball, from({0, 0, 3}, {0, 0, -1}), "flat");
    const ConvexHull segment = *ConvexHull::make(std::vector<Vec3d>{{-1, 0, 0}, {1, 0, 0}});
    expectAt(0.6875, segment, {}, ball, from({0.5, 0, 3}, {0.5, 0, -1}), "segment");
    expectAt(0.6875, *ConvexHull::make(std::vector<Vec3d>{{0, 0, 0}}), {}, ball, from({0, 0, 3}, {0, 0, -1}), "point");
    BodyMotion pressed;
    pressed.start.scale = pressed.end.scale = Vec3d(1, 1, 0);
    expectAt(0.6875, box, pressed, ball, from({0, 0, 3}, {0, 0, -1}), "flattened");
}

/// The least distance between balls and other at a moment, less the radii.
template <typename Other>
Real apart(const PointSet& points, const Affine3d& at, const Other& other, const Affine3d& otherAt, double radius) {
    Real least = std::numeric_limits<Real>::infinity();
    for (std::uint32_t i = 0; i < points.size(); ++i) {
        const Vec3d p = at * points.point(i);
        if constexpr (std::same_as<Other, ConvexHull>) {
            least = std::min(least, oracle::fromHull(p, other, otherAt));
        } else if constexpr (std::same_as<Other, PointSet>) {
            for (std::uint32_t j = 0; j < other.size(); ++j)
                least = std::min(least, (oracle::exact(p) - oracle::exact(otherAt * other.point(j))).norm());
        } else {
            for (std::uint32_t j = 0; j < other.faceCount(); ++j)
                least = std::min(least, oracle::fromTriangle(p, transformed(otherAt, other.triangle(j))));
        }
    }
    return least - static_cast<Real>(radius);
}

template <typename Other, typename Query>
int expectNeverLate(const PointSet& points, const Other& other, const Query& query, const BodyMotion& mp,
                    const BodyMotion& mo, const std::string& story) {
    const auto radius = [&](double t) {
        double sum = points.radius() * oracle::largestSingularValue(mp.placeAt(t).linear());
        if constexpr (std::same_as<Other, PointSet>)
            sum += other.radius() * oracle::largestSingularValue(mo.placeAt(t).linear());
        return sum;
    };
    int hits = 0;
    for (const bool swapped : {false, true}) {
        QueryWork work;
        const Impact found = swapped ? timeOfImpact(query, mo, points, mp, work, {.tolerance = 1e-5})
                                     : timeOfImpact(points, mp, query, mo, work, {.tolerance = 1e-5});
        EXPECT_TRUE(found.complete) << story;
        for (int s = 0; s <= 30; ++s) {
            const double t = s / 30.0;
            if (found.hit && t >= found.t) break;
            EXPECT_GT(apart(points, mp.placeAt(t), other, mo.placeAt(t), radius(t)), -1e-11) << story << ", t = " << t;
        }
        if (!found.hit) continue;
        ++hits;
        // Carried through two scales that change at once, balls are taken for larger than they are, but for the ends.
        const auto swells = [](const BodyMotion& m) {
            int changing = m.start.scale != m.end.scale;
            for (const BodyMotion& carrier : m.carriers) changing += carrier.start.scale != carrier.end.scale;
            return changing > 1;
        };
        if (swells(mp) || (std::same_as<Other, PointSet> && swells(mo))) continue;
        const double left =
            static_cast<double>(apart(points, mp.placeAt(found.t), other, mo.placeAt(found.t), radius(found.t)));
        EXPECT_LE(left, 1.001e-5) << story;
        EXPECT_NEAR(found.distance, std::max(0.0, left), 1e-9) << story;
        // Ball and other touch where it says: within the radius of the ball's centre.
        const Vec3d centre = mp.placeAt(found.t) * points.point(swapped ? found.faces.b : found.faces.a);
        EXPECT_LE((found.point - centre).norm(), radius(found.t) + 1e-5) << story;
    }
    return hits;
}

TEST(BallImpact, IsNeverMissedAndNeverLate) {
    int hits = 0, trials = 0;
    for (std::uint64_t seed = 1; seed <= 60; ++seed) {
        Random random(seed);
        std::mt19937 soups(static_cast<unsigned>(seed));
        std::normal_distribution<double> n;
        const auto direction = [&] { return Vec3d(n(random), n(random), n(random)).normalized(); };
        const auto turn = [&] { return Quatd(n(random), n(random), n(random), n(random)).normalized(); };
        const auto motion = [&](double far) {
            BodyMotion m;
            const Vec3d d = direction();
            m.start.translation = far * d;
            m.end.translation = -0.7 * far * d + direction();
            m.start.rotation = turn();
            m.end.rotation = seed % 3
                                 ? Quatd(Eigen::AngleAxisd(between(random, -1.5, 1.5), direction())) * m.start.rotation
                                 : m.start.rotation;
            if (seed % 4 == 1)
                m.start.scale = Vec3d::Constant(between(random, 0.5, 1.5)),
                m.end.scale = Vec3d::Constant(between(random, 0.5, 1.5));
            for (std::uint64_t i = 0; seed % 5 >= 3 && i < 1 + seed % 2; ++i) {
                BodyMotion carrier{.start = {0.2 * direction(), turn()}, .body_T_mesh = Affine3d(turn())};
                carrier.end = {carrier.start.translation + 0.5 * direction(),
                               Quatd(Eigen::AngleAxisd(between(random, -1, 1), direction())) * carrier.start.rotation};
                if (seed % 4 == 1) carrier.end.scale = Vec3d::Constant(between(random, 0.5, 1.5));
                m.carriers.push_back(carrier);
            }
            return m;
        };
        std::vector<Vec3d> at;
        for (std::size_t i = 0; i < 1 + random() % 12; ++i) at.push_back(0.6 * direction());
        const PointSet points = *PointSet::make(at, seed % 5 ? between(random, 0.02, 0.3) : 0);
        const BodyMotion mp = motion(2.5);
        BodyMotion mo;
        if (seed % 2) mo = motion(0.3);
        const std::string story = "seed " + std::to_string(seed);
        const bodies::Body soup = bodies::soup(soups, 10);
        const TriangleMesh land =
            terrains::make(random, {.columns = 4, .rows = 5, .height = terrains::anyHeights(random)}).mesh();
        std::vector<Vec3d> corners;
        for (int i = 0; i < 9; ++i) corners.push_back(0.8 * direction());
        const ConvexHull hull = *ConvexHull::make(corners);
        const PointSet others = *PointSet::make(corners, between(random, 0, 0.3));
        hits += expectNeverLate(points, soup.mesh(), soup.tree(), mp, mo, story + ", tree");
        hits += expectNeverLate(points, land, *HeightField::recognise(land), mp, mo, story + ", field");
        hits += expectNeverLate(points, hull, hull, mp, mo, story + ", hull");
        hits += expectNeverLate(points, others, others, mp, mo, story + ", points");
        trials += 8;
    }
    EXPECT_GT(hits, trials / 4);
    EXPECT_LT(hits, trials);
}

/// A ball 0.02 from a wall, on an arm whose two joints both grow: it goes away, and nothing is met at the start.
TEST(BallImpact, CarriedByWhatGrowsTheyAreAsLargeAsTheyAreAtTheStart) {
    const PointSet ball = *PointSet::make(std::vector<Vec3d>{Vec3d::Zero()}, 0.1);
    const TriangleTree sheet(bodies::sheet(20, 20).mesh());
    for (const double up : {0.0, 1.0}) {
        BodyMotion motion{.start = {.translation = Vec3d(0, 0, 0.06)},
                          .end = {Vec3d(0, 0, 0.06 + up), Quatd::Identity(), Vec3d::Constant(2)}};
        motion.carriers.push_back(motion);
        QueryWork work;
        const Impact found = timeOfImpact(sheet, {}, ball, motion, work, {.tolerance = 1e-5});
        ASSERT_TRUE(found.complete);
        EXPECT_EQ(found.hit, up == 0) << up;
        // 0.06 (1 + s) above, s = 1 + t; the radius is 0.1 s², told as 0.1 (1 + 3 t): 0.06 (2 + t) = 0.1 (1 + 3 t).
        if (found.hit) {
            EXPECT_NEAR(found.t, 0.02 / 0.24, 1e-3);
        }
    }
}

TEST(BallImpact, BadInputAndExhaustedWorkAreUnknown) {
    const PointSet ball = ballAt({0, 0, 0}, 0.5);
    const bodies::Body sheet = bodies::sheet(4, 4);
    const ConvexHull box = boxHull({2, 2, 2});
    BodyMotion bad = from({0, 0, 3}, {0, 0, -1});
    bad.end.translation.x() = std::numeric_limits<double>::quiet_NaN();
    QueryWork work;
    const auto isUnknown = [](const Impact& i) { return !i.hit && !i.complete && i.t == 0; };
    EXPECT_TRUE(isUnknown(timeOfImpact(sheet.tree(), {}, ball, bad, work)));
    EXPECT_TRUE(isUnknown(timeOfImpact(box, bad, ball, {}, work)));
    EXPECT_TRUE(isUnknown(timeOfImpact(ball, {}, ball, {}, work, {.margin = -2})));
    for (const std::uint64_t limit : {0U, 1U}) {
        QueryWork few{.limit = limit};
        EXPECT_FALSE(timeOfImpact(sheet.tree(), {}, ball, from({0, 0, 3}, {0, 0, -1}), few).complete);
        few = {.limit = limit};
        EXPECT_FALSE(timeOfImpact(box, {}, ball, from({0, 0, 3}, {0, 0, -1}), few).complete);
    }
}

}  // namespace
}  // namespace tessera
