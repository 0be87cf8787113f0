#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <numbers>
#include <random>

#include "server/collision/query/DistanceQuery.h"
#include "server/collision/query/TimeOfImpact.h"
#include "server/collision/query/TouchQuery.h"
#include "tests/unit/motion/Bodies.h"

namespace tessera {
namespace {

using bodies::Body;

BodyMotion from(const Vec3d& start, const Vec3d& end) {
    return {.start = {.translation = start}, .end = {.translation = end}};
}

Impact impactOf(const Body& a, const BodyMotion& ma, const Body& b, const BodyMotion& mb, double tolerance = 1e-4) {
    QueryWork work;
    return timeOfImpact(a.tree(), ma, b.tree(), mb, work, {.tolerance = tolerance});
}

TEST(RigidImpact, BoxesMeetWhenTheyShould) {
    const Body box = bodies::box(Vec3d(2, 2, 2));
    // 10 apart face to face, closing 20.
    const Impact found = impactOf(box, {}, box, from(Vec3d(12, 0.3, 0.2), Vec3d(-8, 0.3, 0.2)));
    ASSERT_TRUE(found.hit);
    EXPECT_LE(found.t, 0.5);
    EXPECT_NEAR(found.t, 0.5, 1e-4 / 20);
    EXPECT_LE(found.distance, 1e-4);
    EXPECT_NEAR(found.normal.x(), 1, 1e-9);
    EXPECT_NEAR(found.point.x(), 1, 1e-4);
}

TEST(RigidImpact, BothMayMove) {
    const Body box = bodies::box(Vec3d(2, 2, 2));
    const Impact found =
        impactOf(box, from(Vec3d(0, 0, 0), Vec3d(5, 50, 0)), box, from(Vec3d(12, 0, 0), Vec3d(-3, 50, 0)));
    ASSERT_TRUE(found.hit);
    EXPECT_NEAR(found.t, 0.5, 1e-5);
    EXPECT_LE(found.t, 0.5);
    EXPECT_NEAR(found.point.y(), 25, 1.1);
}

TEST(RigidImpact, BodiesThatTravelTogetherNeverMeet) {
    const Body box = bodies::box(Vec3d(2, 2, 2));
    EXPECT_FALSE(
        impactOf(box, from(Vec3d(0, 0, 0), Vec3d(500, 70, 1)), box, from(Vec3d(2.01, 0, 0), Vec3d(502.01, 70, 1))).hit);
}

TEST(RigidImpact, AGrowingBallReachesTheWall) {
    const Body ball = bodies::sphere(1, 24, 32), wall = bodies::sheet(20, 20);
    BodyMotion growing;
    growing.start.translation = growing.end.translation = Vec3d(0.01, 0.02, 3);
    growing.end.scale = Vec3d::Constant(5);
    // Its south pole is a vertex: 1 + 4 t = 3.
    const Impact found = impactOf(wall, {}, ball, growing);
    ASSERT_TRUE(found.hit);
    EXPECT_LE(found.t, 0.5);
    EXPECT_NEAR(found.t, 0.5, 1e-4);
}

TEST(RigidImpact, ABallThatGrowsBesideAnotherReachesIt) {
    const Body ball = bodies::sphere(1, 24, 32);
    BodyMotion growing;
    growing.start.translation = growing.end.translation = Vec3d(0, 0, 4);
    growing.end.scale = Vec3d::Constant(5);
    // Pole on pole: 1 + 4 t = 3.
    const Impact found = impactOf(ball, {}, ball, growing);
    ASSERT_TRUE(found.hit);
    EXPECT_LE(found.t, 0.5);
    EXPECT_NEAR(found.t, 0.5, 1e-4);
}

/// A body on an arc flies past the wall at first, and into it in the end: only the bend of its way brings it there.
TEST(RigidImpact, AnArcBendsIntoTheWall) {
    BodyMotion quarter;
    quarter.end.rotation = Quatd(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3d::UnitZ()));
    Body point;
    const std::uint32_t v = point.vertex(Vec3d(2, 0, 0));
    point.face(v, v, v);
    const Body ball = bodies::sphere(0.5, 16, 20).moved(Vec3d(2, 0, 0));
    for (const Body& wall : {bodies::box(Vec3d(2, 20, 20)), bodies::grid(40, 20)}) {
        const bool isBox = wall.mesh().faceCount() == 12;
        BodyMotion standing;  // its face is the plane x = 1
        if (!isBox) {
            standing.start.rotation = standing.end.rotation =
                Quatd(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3d::UnitY()));
            standing.start.translation = standing.end.translation = Vec3d(1, 0, 0);
        }
        const Impact ofPoint = impactOf(wall, standing, point, quarter);
        ASSERT_TRUE(ofPoint.hit);
        EXPECT_LE(ofPoint.t, 2.0 / 3 + 1e-15);  // 2 cos(90 t) = 1
        EXPECT_NEAR(ofPoint.t, 2.0 / 3, 1e-4);
        const Impact ofBall = impactOf(wall, standing, ball, quarter);
        ASSERT_TRUE(ofBall.hit);
        EXPECT_GE(ofBall.t, std::acos(0.75) / (std::numbers::pi / 2) - 1e-3);
        EXPECT_LE(ofBall.t, std::acos(0.74) / (std::numbers::pi / 2));
        EXPECT_LE(ofBall.distance, 1e-4);
    }
}

TEST(RigidImpact, AStretchedBodyReachesAsFarAsItIsStretched) {
    const Body box = bodies::box(Vec3d(1, 1, 1)), wall = bodies::sheet(20, 20);
    BodyMotion stretching;
    stretching.start.translation = stretching.end.translation = Vec3d(0, 0, 2);
    stretching.end.scale = Vec3d(0.2, -3, 7);  // half of 1 + 6 t = 2
    const Impact found = impactOf(wall, {}, box, stretching);
    ASSERT_TRUE(found.hit);
    EXPECT_LE(found.t, 0.5);
    EXPECT_NEAR(found.t, 0.5, 1e-4);
}

TEST(RigidImpact, ATurningRodMeetsThePostAtItsAngle) {
    const Body rod = bodies::box(Vec3d(4, 0.02, 0.02)), post = bodies::box(Vec3d(0.02, 0.02, 2));
    // The rod turns 170 degrees about z; the post stands at 60.
    const double degree = std::numbers::pi / 180;
    BodyMotion turning;
    turning.end.rotation = Quatd(Eigen::AngleAxisd(170 * degree, Vec3d::UnitZ()));
    BodyMotion standing;
    standing.start.translation = standing.end.translation =
        1.5 * Vec3d(std::cos(60 * degree), std::sin(60 * degree), 0);
    const Impact found = impactOf(rod, turning, post, standing, 1e-6);
    ASSERT_TRUE(found.hit);
    // The corner of the post is reached a little before 60 degrees.
    EXPECT_LT(found.t, 60.0 / 170);
    EXPECT_GT(found.t, (60.0 - 1.2) / 170);
    // The shorter arc is taken: the other way round it would come from the other side.
    turning.end.rotation.coeffs() *= -1;
    EXPECT_EQ(impactOf(rod, turning, post, standing, 1e-6).t, found.t);
}

TEST(RigidImpact, TouchingAtTheStartIsAtZero) {
    const Body box = bodies::box(Vec3d(2, 2, 2));
    for (const Vec3d& end : {Vec3d(2, 0, 0), Vec3d(9, 0, 0), Vec3d(2, 5, 0), Vec3d(-3, 0, 0)}) {
        const Impact found = impactOf(box, {}, box, from(Vec3d(2, 0, 0), end));
        EXPECT_TRUE(found.hit);
        EXPECT_EQ(found.t, 0);
        EXPECT_EQ(found.distance, 0);
    }
    const Impact deep = impactOf(box, {}, box, from(Vec3d(1.3, 0.4, 0.1), Vec3d(9, 0, 0)));
    EXPECT_TRUE(deep.hit);
    EXPECT_EQ(deep.t, 0);
    EXPECT_EQ(deep.distance, 0);
}

TEST(RigidImpact, ContactAtTheVeryEndCounts) {
    const Body box = bodies::box(Vec3d(2, 2, 2));
    const Impact found = impactOf(box, {}, box, from(Vec3d(4, 0, 0), Vec3d(2, 0, 0)));
    EXPECT_TRUE(found.hit);
    EXPECT_NEAR(found.t, 1, 1e-4);
}

TEST(RigidImpact, PassingOutsideTheToleranceIsNoHit) {
    const Body box = bodies::box(Vec3d(2, 2, 2));
    const double gap = 1e-3;
    EXPECT_FALSE(impactOf(box, {}, box, from(Vec3d(-20, 2 + gap, 0.3), Vec3d(20, 2 + gap, 0.3))).hit);
    // Through a gate that is hardly wider.
    const Body gate = bodies::box(Vec3d(1, 1, 1))
                          .moved(Vec3d(0, 1.5 + gap, 0))
                          .with(bodies::box(Vec3d(1, 1, 1)).moved(Vec3d(0, -1.5 - gap, 0)));
    EXPECT_FALSE(impactOf(gate, {}, box, from(Vec3d(-20, 0, 0.1), Vec3d(20, 0, 0.1))).hit);
    EXPECT_TRUE(impactOf(gate, {}, box, from(Vec3d(-20, 3 * gap, 0.1), Vec3d(20, 3 * gap, 0.1))).hit);
}

TEST(RigidImpact, LeavingFromWithinTheToleranceIsNoHit) {
    const Body box = bodies::box(Vec3d(2, 2, 2));
    EXPECT_FALSE(impactOf(box, {}, box, from(Vec3d(2.00005, 0, 0), Vec3d(9, 0, 0))).hit);
    EXPECT_FALSE(impactOf(box, {}, box, from(Vec3d(2.00005, 0, 0), Vec3d(2.00005, 9, 0))).hit) << "sliding by";
}

/// Fine sheets that slide and turn over each other, outside the tolerance: each face passes many others.
TEST(RigidImpact, LongGrazingTakesBoundedWork) {
    const Body sheet = bodies::grid(40, 1.0);
    BodyMotion grazing = from(Vec3d(0, 0, 3e-4), Vec3d(0.7, 0.4, 3e-4));
    QueryWork straight;
    EXPECT_FALSE(timeOfImpact(sheet.tree(), {}, sheet.tree(), grazing, straight).hit);
    EXPECT_LT(straight.boxTests + straight.triangleTests, 10u);
    grazing.end.rotation = Quatd(Eigen::AngleAxisd(0.5, Vec3d::UnitZ()));
    QueryWork turning;
    EXPECT_FALSE(timeOfImpact(sheet.tree(), {}, sheet.tree(), grazing, turning).hit);
    EXPECT_LT(turning.boxTests + turning.triangleTests, 4'000'000u);
    std::printf("turning: %llu + %llu\n", static_cast<unsigned long long>(turning.boxTests),
                static_cast<unsigned long long>(turning.triangleTests));
}

TEST(RigidImpact, GivesUpWhereToldToAndSaysHowFarItIsFree) {
    const Body ball = bodies::sphere(1, 30, 40);
    const BodyMotion way = from(Vec3d(5, 0.4, 0.1), Vec3d(-5, 0, 0));
    const Impact truth = impactOf(ball, {}, ball, way);
    ASSERT_TRUE(truth.hit);
    double before = 0;
    for (const std::uint64_t limit : {0u, 1u, 5u, 20u}) {
        QueryWork work{.limit = limit};
        const Impact found = timeOfImpact(ball.tree(), {}, ball.tree(), way, work);
        EXPECT_FALSE(found.complete);
        EXPECT_FALSE(found.hit);
        EXPECT_LE(found.t, truth.t);
        EXPECT_GE(found.t, before);
        before = found.t;
    }
    EXPECT_GT(before, 0.1);
}

/// So that what bounds a frame's tests bounds its time.
TEST(RigidImpact, AStepCountsAsAHundredTests) {
    const Body sheet = bodies::grid(40, 1.0);
    BodyMotion turning = from(Vec3d(0, 0, 3e-4), Vec3d(0.7, 0.4, 3e-4));
    turning.end.rotation = Quatd(Eigen::AngleAxisd(0.5, Vec3d::UnitZ()));
    QueryWork bounded{.limit = 100'000}, stepped;
    const Impact atLimit = timeOfImpact(sheet.tree(), {}, sheet.tree(), turning, bounded);
    const Impact atSteps = timeOfImpact(sheet.tree(), {}, sheet.tree(), turning, stepped, {.maxSteps = 1000});
    EXPECT_FALSE(atLimit.complete);
    EXPECT_FALSE(atSteps.complete);
    EXPECT_LE(atLimit.t, atSteps.t);
    EXPECT_GE(stepped.triangleTests, 100'000u);
    EXPECT_LE(bounded.boxTests + bounded.triangleTests, 110'000u);
}

TEST(RigidImpact, BadInputHasDefinedAnswers) {
    const Body box = bodies::box(Vec3d(2, 2, 2)), nothing;
    const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
    const BodyMotion way = from(Vec3d(12, 0, 0), Vec3d(-8, 0, 0));
    const auto unknown = [](const Impact& i) { return !i.hit && !i.complete && i.t == 0; };
    EXPECT_TRUE(unknown(impactOf(box, {}, box, from(Vec3d(nan, 0, 0), Vec3d(0, 0, 0)))));
    EXPECT_TRUE(unknown(impactOf(box, from(Vec3d(0, 0, 0), Vec3d(infinity, 0, 0)), box, {})));
    BodyMotion noRotation = way;
    noRotation.end.rotation = Quatd(0, 0, 0, 0);
    EXPECT_TRUE(unknown(impactOf(box, {}, box, noRotation)));
    BodyMotion noMap = way;
    noMap.body_T_mesh.linear()(1, 2) = nan;
    EXPECT_TRUE(unknown(impactOf(box, {}, box, noMap)));
    EXPECT_FALSE(impactOf(nothing, {}, box, way).hit);
    EXPECT_TRUE(impactOf(nothing, {}, box, way).complete);
    EXPECT_EQ(impactOf(box, {}, nothing, way).t, 1);
    // As near as rounding can tell.
    for (const double tolerance : {0.0, -1.0, nan}) {
        const Impact found = impactOf(box, {}, box, way, tolerance);
        EXPECT_TRUE(found.hit && found.complete);
        EXPECT_LE(found.t, 0.5);
        EXPECT_NEAR(found.t, 0.5, 1e-12);
        EXPECT_LT(found.distance, 1e-11);
    }
    EXPECT_LE(impactOf(box, {}, box, way, infinity).t, 0.5);
    // Flat, and flattened to a point: what is left of it still meets things.
    BodyMotion flat = way;
    flat.start.scale = flat.end.scale = Vec3d(0, 1, 1);
    EXPECT_NEAR(impactOf(box, {}, box, flat).t, 11.0 / 20, 1e-5);
    flat.start.scale = flat.end.scale = Vec3d(0, 0, 0);
    EXPECT_NEAR(impactOf(box, {}, box, flat).t, 11.0 / 20, 1e-5);
    flat.start.scale = Vec3d(1, 1, 1), flat.end.scale = Vec3d(-1, -1, -1);  // through nothing and out again
    EXPECT_TRUE(impactOf(box, {}, box, flat).hit);
}

/// A motion of one body past another, and what it is of.
struct Trial {
    BodyMotion a, b;
};

enum class Kind { kTranslation, kTurning, kHalfTurn, kScaling, kBoth, kNonUniform, kOrbit };

Trial randomTrial(std::mt19937& random, Kind kind) {
    std::normal_distribution<double> n;
    std::uniform_real_distribution<double> u(-1, 1);
    const auto direction = [&] { return Vec3d(n(random), n(random), n(random)).normalized(); };
    const auto turn = [&](double most) { return Quatd(Eigen::AngleAxisd(most * u(random), direction())); };
    const auto fill = [&](BodyMotion& m, double distance) {
        const Vec3d d = direction();
        m.start.translation = distance * d;
        m.end.translation = -0.6 * distance * d + 3 * direction();
        m.start.rotation = Quatd(n(random), n(random), n(random), n(random)).normalized();
        const double most = kind == Kind::kTranslation                        ? 0
                            : kind == Kind::kHalfTurn || kind == Kind::kOrbit ? std::numbers::pi * 170 / 180
                                                                              : std::numbers::pi / 3;
        m.end.rotation = turn(most) * m.start.rotation;
        if (kind == Kind::kScaling) {
            m.start.scale = Vec3d::Constant(1 + 0.4 * u(random));
            m.end.scale = Vec3d::Constant(1 + 0.6 * u(random));
        }
        if (kind == Kind::kNonUniform)
            for (int k = 0; k < 3; ++k) {
                m.start.scale[k] = 1 + 0.6 * u(random);
                m.end.scale[k] = u(random) > 0.8 ? -0.5 : 1 + 0.6 * u(random);
            }
    };
    Trial trial;
    fill(trial.b, 2.4 + 0.6 * u(random));
    if (kind == Kind::kBoth || kind == Kind::kScaling || kind == Kind::kNonUniform) fill(trial.a, 0.5);
    return trial;
}

class RandomMotions : public testing::TestWithParam<Kind> {};

/// Against brute force: no dense sample before t touches by the exact predicate on every pair of faces; at t the
/// distance is what is said, and at most the tolerance; the hits that samples see are seen.
TEST_P(RandomMotions, AreNeverMissedAndNeverLate) {
    const unsigned seed = 100 + static_cast<unsigned>(GetParam());
    std::mt19937 random(seed);
    const std::array<Body, 4> shapes = {bodies::sphere(0.8, 6, 8), bodies::box(Vec3d(1, 0.7, 1.4)),
                                        bodies::soup(random, 30), bodies::torus(0.8, 0.3, 10, 6)};
    int hits = 0;
    constexpr int kTrials = 60;
    for (int i = 0; i < kTrials; ++i) {
        const auto again = [&] { return testing::Message() << "seed " << seed << ", trial " << i; };
        Body a = shapes[random() % 4], b = shapes[random() % 4];
        if (GetParam() == Kind::kOrbit) {  // about a point outside of it
            std::uniform_real_distribution<double> u(-1, 1);
            a = a.moved(Vec3d(u(random), u(random), 2));
            b = b.moved(Vec3d(2, u(random), u(random)));
        }
        const Trial trial = randomTrial(random, GetParam());
        const double tolerance = i % 3 ? 1e-4 : 1e-9;
        const Impact found = impactOf(a, trial.a, b, trial.b, tolerance);
        ASSERT_TRUE(found.complete) << again();
        constexpr int kSamples = 150;
        for (int s = 0; s <= kSamples; ++s) {
            const double t = static_cast<double>(s) / kSamples;
            if (found.hit && t >= found.t) break;
            ASSERT_FALSE(bodies::touching(a, trial.a.at(t).matrix(), b, trial.b.at(t).matrix()))
                << again() << ", t = " << t;
        }
        if (!found.hit) continue;
        ++hits;
        const double distance = bodies::distance(a, trial.a.at(found.t).matrix(), b, trial.b.at(found.t).matrix());
        ASSERT_LE(distance, tolerance) << again();
        ASSERT_NEAR(found.distance, distance, 1e-12) << again();
        ASSERT_NEAR(found.normal.norm(), 1, 1e-9) << again();
        // The other way round: the same hit, to within what the tolerance leaves open.
        const Impact swapped = impactOf(b, trial.b, a, trial.a, tolerance);
        ASSERT_TRUE(swapped.hit) << again();
        ASSERT_LE(bodies::distance(a, trial.a.at(swapped.t).matrix(), b, trial.b.at(swapped.t).matrix()), tolerance)
            << again();
    }
    EXPECT_GT(hits, kTrials / 8);
    EXPECT_LT(hits, kTrials);
}

INSTANTIATE_TEST_SUITE_P(Kinds, RandomMotions,
                         testing::Values(Kind::kTranslation, Kind::kTurning, Kind::kHalfTurn, Kind::kScaling,
                                         Kind::kBoth, Kind::kNonUniform, Kind::kOrbit));

/// A body whose mesh sits in its moving frame as the map says.
class FixedMaps : public testing::TestWithParam<int> {
public:
    static Affine3d random(int kind, std::mt19937& random) {
        std::normal_distribution<double> n;
        std::uniform_real_distribution<double> u(-1, 1);
        Affine3d map = Affine3d::Identity();
        const Mat3d turn = Quatd(n(random), n(random), n(random), n(random)).normalized().toRotationMatrix();
        switch (kind) {
            case 0:
                map.linear() = turn;
                break;  // rigid
            case 1:
                map.linear() = -1.3 * turn;
                break;  // a mirrored similarity
            case 2:
                map.linear() = turn * Vec3d(1.6, 0.5, -0.9).asDiagonal() * turn.transpose();
                break;
            case 3:
                map.linear() << 1, 0.7, 0, 0, 1, -0.5, 0, 0, 0.8;
                break;  // a shear
            case 4:
                map.linear() = turn * Vec3d(1, 1, 0).asDiagonal();
                break;  // flat
            default:
                map.linear() = 1e-3 * turn;
                break;  // of other units
        }
        map.translation() = 0.5 * Vec3d(u(random), u(random), u(random));
        return map;
    }
};

/// Against brute force, as RandomMotions; and beside the same bodies with the map worked into their vertices.
TEST_P(FixedMaps, AreNeverMissedAndNeverLate) {
    const unsigned seed = 300 + static_cast<unsigned>(GetParam());
    std::mt19937 random(seed);
    const std::array<Body, 4> shapes = {bodies::sphere(0.8, 6, 8), bodies::box(Vec3d(1, 0.7, 1.4)),
                                        bodies::soup(random, 30), bodies::torus(0.8, 0.3, 10, 6)};
    const Kind kinds[] = {Kind::kTranslation, Kind::kBoth, Kind::kHalfTurn, Kind::kScaling, Kind::kNonUniform};
    int hits = 0;
    constexpr int kTrials = 60;
    for (int i = 0; i < kTrials; ++i) {
        const auto again = [&] { return testing::Message() << "seed " << seed << ", trial " << i; };
        Body a = shapes[random() % 4], b = shapes[random() % 4];
        Trial trial = randomTrial(random, kinds[i % 5]);
        trial.a.body_T_mesh = FixedMaps::random(i % 2 ? GetParam() : i % 6, random);
        trial.b.body_T_mesh = FixedMaps::random(GetParam(), random);
        if (i % 4 == 3) {  // a mesh far from its origin, and a map that brings it back
            a = a.moved(Vec3d(100, -40, 7));
            trial.a.body_T_mesh.translate(Vec3d(-100, 40, -7));
        }
        if (GetParam() == 5) {
            for (double& x : b.positions) x *= 1000;
            b = b.moved(Vec3d::Zero());  // with a tree of its own
        }
        const double tolerance = i % 3 ? 1e-4 : 1e-9;
        const Impact found = impactOf(a, trial.a, b, trial.b, tolerance);
        ASSERT_TRUE(found.complete) << again();
        constexpr int kSamples = 150;
        for (int s = 0; s <= kSamples; ++s) {
            const double t = static_cast<double>(s) / kSamples;
            if (found.hit && t >= found.t) break;
            ASSERT_FALSE(bodies::touching(a, trial.a.placeAt(t), b, trial.b.placeAt(t))) << again() << ", t = " << t;
        }
        Body bakedA = a, bakedB = b;
        const auto bake = [](Body& body, BodyMotion& motion) {
            Body out;
            for (std::size_t k = 0; k < body.positions.size(); k += 3)
                out.vertex(motion.body_T_mesh * Vec3d(body.positions[k], body.positions[k + 1], body.positions[k + 2]));
            out.indices = body.indices;
            body = out;
            motion.body_T_mesh.setIdentity();
        };
        Trial baked = trial;
        bake(bakedA, baked.a);
        bake(bakedB, baked.b);
        const Impact beside = impactOf(bakedA, baked.a, bakedB, baked.b, tolerance);
        if (!found.hit) {
            ASSERT_TRUE(!beside.hit || beside.distance > 0) << again();
            continue;
        }
        ++hits;
        const double distance = bodies::distance(a, trial.a.placeAt(found.t), b, trial.b.placeAt(found.t));
        ASSERT_LE(distance, tolerance) << again();
        ASSERT_NEAR(found.distance, distance, 1e-12) << again();
        ASSERT_NEAR(found.normal.norm(), 1, 1e-9) << again();
        ASSERT_TRUE(beside.hit) << again();
        ASSERT_NEAR(beside.t, found.t, 1e-3) << again();
    }
    EXPECT_GT(hits, kTrials / 5);
    EXPECT_LT(hits, kTrials);
}

INSTANTIATE_TEST_SUITE_P(Maps, FixedMaps, testing::Range(0, 6));

/// Both bodies carried along by one more rigid motion at rest: nothing changes but the frame.
TEST(RigidImpact, DoesNotDependOnTheFrame) {
    constexpr unsigned kSeed = 31;
    std::mt19937 random(kSeed);
    const Body a = bodies::torus(0.8, 0.3, 12, 8), b = bodies::sphere(0.6, 8, 10);
    const Quatd turn = Quatd(0.3, -0.5, 0.7, 0.1).normalized();
    const Vec3d shift(30, -7, 12);
    const auto carried = [&](BodyMotion m) {
        for (Pose* p : {&m.start, &m.end}) {
            p->translation = turn * p->translation + shift;
            p->rotation = turn * p->rotation;
        }
        return m;
    };
    int hits = 0;
    for (int i = 0; i < 60; ++i) {
        const Trial trial = randomTrial(random, Kind::kBoth);
        const Impact here = impactOf(a, trial.a, b, trial.b, 1e-6),
                     there = impactOf(a, carried(trial.a), b, carried(trial.b), 1e-6);
        ASSERT_EQ(here.hit, there.hit) << "seed " << kSeed << ", trial " << i;
        if (!here.hit) continue;
        ++hits;
        ASSERT_NEAR(here.t, there.t, 1e-3) << "seed " << kSeed << ", trial " << i;
        const bool same = here.faces == there.faces && std::abs(here.t - there.t) < 1e-9;
        ASSERT_TRUE(!same || (turn * here.normal - there.normal).norm() < 1e-2) << "seed " << kSeed << ", trial " << i;
    }
    EXPECT_GT(hits, 15);
}

/// Run backwards, a motion that meets something still does.
TEST(RigidImpact, MeetsBackwardsWhatItMeetsForwards) {
    constexpr unsigned kSeed = 32;
    std::mt19937 random(kSeed);
    const Body a = bodies::torus(0.8, 0.3, 12, 8), b = bodies::box(Vec3d(0.5, 0.6, 0.7));
    int hits = 0, misses = 0;
    for (int i = 0; i < 100; ++i) {
        const Trial trial = randomTrial(random, Kind::kTurning);
        const Impact forwards = impactOf(a, trial.a, b, trial.b, 1e-9);
        const Impact backwards = impactOf(a, trial.a, b, {trial.b.end, trial.b.start}, 1e-9);
        ASSERT_EQ(forwards.hit, backwards.hit) << "seed " << kSeed << ", trial " << i;
        ASSERT_TRUE(!forwards.hit || forwards.t + backwards.t <= 1 + 1e-6) << "seed " << kSeed << ", trial " << i;
        ++(forwards.hit ? hits : misses);
    }
    EXPECT_GT(hits, 20);
    EXPECT_GT(misses, 20);
}

/// Whatever bounds the triangles, the faces decide.
TEST(RigidImpact, EveryKindOfTreeIsAsRight) {
    constexpr unsigned kSeed = 33;
    std::mt19937 random(kSeed);
    const Body a = bodies::torus(0.8, 0.3, 30, 20), b = bodies::sphere(0.6, 20, 30);
    for (const VolumeKind kind : {VolumeKind::kSphere, VolumeKind::kAabb, VolumeKind::kObb, VolumeKind::kDop6,
                                  VolumeKind::kDop14, VolumeKind::kDop18, VolumeKind::kDop26}) {
        std::mt19937 again(kSeed);
        const TriangleTree treeA(a.mesh(), {.volume = kind}), treeB(b.mesh(), {.volume = kind});
        for (int i = 0; i < 20; ++i) {
            const Trial trial = randomTrial(again, i % 2 ? Kind::kBoth : Kind::kNonUniform);
            const Impact truth = impactOf(a, trial.a, b, trial.b, 1e-6);
            QueryWork work;
            const Impact found = timeOfImpact(treeA, trial.a, treeB, trial.b, work, {.tolerance = 1e-6});
            ASSERT_EQ(found.hit, truth.hit) << "seed " << kSeed << ", trial " << i;
            ASSERT_TRUE(!found.hit || std::abs(found.t - truth.t) < 1e-4) << "seed " << kSeed << ", trial " << i;
        }
    }
}

/// On real models: beside the distance query and the touch query of the same library.
TEST(RigidImpact, RealModelsAreNotTouchedBeforeT) {
    const auto file = bodies::dataFolder() / "meshes/spot/spot_low_resolution.obj";
    if (!std::filesystem::exists(file))
        GTEST_SKIP() << "no test data at " << bodies::dataFolder() << " (set TESSERA_TEST_DATA)";
    const Body spot = bodies::readObj(file);
    const Vec3d centre = spot.mesh().bounds().center();
    const double size = spot.mesh().bounds().size().norm();
    constexpr unsigned kSeed = 34;
    std::mt19937 random(kSeed);
    int hits = 0;
    for (int i = 0; i < 40; ++i) {
        Trial trial = randomTrial(random, i % 2 ? Kind::kHalfTurn : Kind::kTurning);
        trial.a.start.translation = trial.a.end.translation = -centre;
        for (Pose* p : {&trial.b.start, &trial.b.end})
            p->translation = 0.45 * size * p->translation - p->rotation * centre;
        const Impact found = impactOf(spot, trial.a, spot, trial.b);
        const auto at = [&](double t) -> Affine3d {
            return trial.a.at(t).matrix().inverse(Eigen::Affine) * trial.b.at(t).matrix();
        };
        for (int s = 0; s <= 200; ++s) {
            const double t = s / 200.0;
            if (found.hit && t >= found.t) break;
            QueryWork work;
            ASSERT_EQ(firstTouching(spot.tree(), spot.tree(), at(t), work).touch, Touch::kNo)
                << "seed " << kSeed << ", trial " << i;
        }
        if (!found.hit) continue;
        ++hits;
        QueryWork work;
        const Distance d = distanceBetween(spot.tree(), spot.tree(), at(found.t), work);
        ASSERT_LE(d.distance, 1e-4) << "seed " << kSeed << ", trial " << i;
        ASSERT_NEAR(d.distance, found.distance, 1e-12) << "seed " << kSeed << ", trial " << i;
    }
    EXPECT_GT(hits, 10);
}

}  // namespace
}  // namespace tessera
