#include "server/collision/mesh/ElementaryMotion.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/unit/motion/ExactQueries.h"

namespace tessera {
namespace {

/// A triangle without area is the segment or point that it is.
ElementaryImpact vertexFaceImpact(const Vec3d& start, const Vec3d& end, const Triangle& faceStart,
                                  const Triangle& faceEnd, const ElementaryOptions& options = {}) {
    return trianglesImpact({start, start, start}, {end, end, end}, faceStart, faceEnd, options);
}
using Edge = std::array<Vec3d, 2>;
ElementaryImpact edgeEdgeImpact(const Edge& aStart, const Edge& aEnd, const Edge& bStart, const Edge& bEnd,
                                const ElementaryOptions& options = {}) {
    const auto thin = [](const Edge& edge) { return Triangle{edge[0], edge[1], edge[1]}; };
    return trianglesImpact(thin(aStart), thin(aEnd), thin(bStart), thin(bEnd), options);
}

struct Tally {
    int hits = 0, missed = 0, falsePositives = 0;
    std::uint64_t steps = 0;
    std::uint32_t mostSteps = 0;
};

ElementaryImpact answer(const ccd::Query& q, bool vertexFace, ElementaryOptions options) {
    const auto& p = q.points;
    // Each coordinate may be off by the slack.
    options.slack = q.slack * std::sqrt(3.0);
    return vertexFace ? vertexFaceImpact(p[0], p[4], {p[1], p[2], p[3]}, {p[5], p[6], p[7]}, options)
                      : edgeEdgeImpact({p[0], p[1]}, {p[4], p[5]}, {p[2], p[3]}, {p[6], p[7]}, options);
}

void ask(const ccd::Query& q, bool vertexFace, double tolerance, Tally& tally) {
    const ElementaryImpact found = answer(q, vertexFace, {.tolerance = tolerance});
    tally.hits += q.hit;
    tally.missed += q.hit && !found.hit;
    tally.falsePositives += !q.hit && found.hit;
    tally.steps += found.steps;
    tally.mostSteps = std::max(tally.mostSteps, found.steps);
    EXPECT_TRUE(found.hit || !q.hit) << "missed: " << q.file << ':' << q.line;
    EXPECT_TRUE(found.complete) << q.file << ':' << q.line;
    if (tolerance > 0) {
        EXPECT_TRUE(!found.hit || found.distance <= tolerance + 2 * q.slack) << q.file << ':' << q.line;
    }
}

class ExactQueries : public testing::Test {
protected:
    void SetUp() override {
        if (!std::filesystem::exists(ccd::folder()))
            GTEST_SKIP() << "no test data at " << ccd::folder() << " (set TESSERA_TEST_DATA)";
    }
};

/// How many are reported for nothing is what it is today: a change that raises it has to say why. All of these pass
/// each other within 5e-15.
TEST_F(ExactQueries, NoneIsMissedAndFewAreReportedForNothing) {
    const std::vector<ccd::Query> vertexFace = ccd::read("vertex-face"), edgeEdge = ccd::read("edge-edge");
    for (const double tolerance : {1e-6, 1e-10, 0.0}) {
        Tally tally;
        for (const ccd::Query& q : vertexFace) ask(q, true, tolerance, tally);
        for (const ccd::Query& q : edgeEdge) ask(q, false, tolerance, tally);
        std::printf("tolerance %g: %zu queries, %d hits, %d missed, %d false positives, %llu steps, at most %u\n",
                    tolerance, vertexFace.size() + edgeEdge.size(), tally.hits, tally.missed, tally.falsePositives,
                    static_cast<unsigned long long>(tally.steps), tally.mostSteps);
        EXPECT_EQ(tally.hits, 329);
        EXPECT_EQ(tally.missed, 0);
        EXPECT_LE(tally.falsePositives, tolerance == 1e-6 ? 97 : 95);
    }
}

/// The guarantee for data that are no doubles: here they are cut to float, and the slack says so.
TEST_F(ExactQueries, NoneIsMissedThoughTheCornersWereRounded) {
    for (const bool vertexFace : {true, false}) {
        Tally tally;
        for (ccd::Query q : ccd::read(vertexFace ? "vertex-face" : "edge-edge")) {
            for (Vec3d& p : q.points)
                for (int k = 0; k < 3; ++k) {
                    const double rounded = static_cast<float>(p[k]);
                    q.slack = std::max(q.slack, std::abs(rounded - p[k]));
                    p[k] = rounded;
                }
            ask(q, vertexFace, 1e-6, tally);
        }
        EXPECT_EQ(tally.missed, 0);
    }
}

/// The answer must not depend on which is A, on the order of corners, nor on where the origin is.
TEST_F(ExactQueries, SwappedEdgesAndTurnedFacesAreNotMissedEither) {
    for (const ccd::Query& q : ccd::read("edge-edge")) {
        const auto& p = q.points;
        const ElementaryImpact found = edgeEdgeImpact({p[3], p[2]}, {p[7], p[6]}, {p[1], p[0]}, {p[5], p[4]});
        EXPECT_TRUE(found.hit || !q.hit) << q.file << ':' << q.line;
    }
    for (const ccd::Query& q : ccd::read("vertex-face")) {
        const auto& p = q.points;
        const ElementaryImpact found = vertexFaceImpact(p[0], p[4], {p[3], p[1], p[2]}, {p[7], p[5], p[6]});
        EXPECT_TRUE(found.hit || !q.hit) << q.file << ':' << q.line;
    }
}

const Triangle kFloor{Vec3d(-1, -1, 0), Vec3d(1, -1, 0), Vec3d(0, 1, 0)};

TEST(VertexFace, AFallingCornerArrivesWhenItShould) {
    const ElementaryImpact found = vertexFaceImpact(Vec3d(0, 0, 3), Vec3d(0, 0, -1), kFloor, kFloor);
    EXPECT_TRUE(found.hit);
    EXPECT_LE(found.t, 0.75);
    EXPECT_NEAR(found.t, 0.75, 1e-6);
    EXPECT_NEAR(found.onA.z(), 0, 1e-6);
}

TEST(VertexFace, AMissBesideTheFaceIsNone) {
    EXPECT_FALSE(vertexFaceImpact(Vec3d(0.6, 0, 3), Vec3d(0.6, 0, -1), kFloor, kFloor).hit);
    EXPECT_TRUE(vertexFaceImpact(Vec3d(0.5, 0, 3), Vec3d(0.5, 0, -1), kFloor, kFloor).hit) << "on its very edge";
}

TEST(VertexFace, ContactAtTheStartIsAtZero) {
    const ElementaryImpact leaving = vertexFaceImpact(Vec3d(0, 0, 0), Vec3d(0, 0, 1), kFloor, kFloor);
    EXPECT_TRUE(leaving.hit);
    EXPECT_EQ(leaving.t, 0);
    const ElementaryImpact sliding = vertexFaceImpact(Vec3d(0, 0, 0), Vec3d(0.1, 0.1, 0), kFloor, kFloor);
    EXPECT_TRUE(sliding.hit);
    EXPECT_EQ(sliding.t, 0);
}

TEST(VertexFace, LeavingFromWithinTheToleranceIsNoHit) {
    EXPECT_FALSE(vertexFaceImpact(Vec3d(0, 0, 1e-7), Vec3d(0, 0, 1), kFloor, kFloor).hit);
    EXPECT_FALSE(vertexFaceImpact(Vec3d(-5, 0, 1e-7), Vec3d(5, 0, 1e-7), kFloor, kFloor).hit) << "sliding over it";
}

TEST(VertexFace, NothingAfterUpToIsLookedFor) {
    const ElementaryImpact found = vertexFaceImpact(Vec3d(0, 0, 3), Vec3d(0, 0, -1), kFloor, kFloor, {.upTo = 0.7});
    EXPECT_FALSE(found.hit);
    EXPECT_EQ(found.t, 0.7);
}

TEST(EdgeEdge, CrossedEdgesMeetWhenTheyShould) {
    const Edge along{Vec3d(-1, 0, 0), Vec3d(1, 0, 0)};
    const Edge above{Vec3d(0, -1, 2), Vec3d(0, 1, 2)}, below{Vec3d(0, -1, -1), Vec3d(0, 1, -1)};
    const ElementaryImpact found = edgeEdgeImpact(along, along, above, below);
    EXPECT_TRUE(found.hit);
    EXPECT_LE(found.t, 2.0 / 3);
    EXPECT_NEAR(found.t, 2.0 / 3, 1e-6);
}

TEST(EdgeEdge, ParallelEdgesAndPointsAreNothingSpecial) {
    const Edge low{Vec3d(-1, 0, 0), Vec3d(1, 0, 0)}, high{Vec3d(-1, 0, 1), Vec3d(1, 0, 1)};
    const ElementaryImpact meeting = edgeEdgeImpact(low, high, high, low);
    EXPECT_TRUE(meeting.hit);
    EXPECT_NEAR(meeting.t, 0.5, 1e-6);
    const Edge point{Vec3d(0.3, 0, 4), Vec3d(0.3, 0, 4)}, through{Vec3d(0.3, 0, -4), Vec3d(0.3, 0, -4)};
    EXPECT_NEAR(edgeEdgeImpact(point, through, low, low).t, 0.5, 1e-6);
    EXPECT_FALSE(edgeEdgeImpact(low, low, high, high).hit);
}

/// Corners of random triangles go random ways: no sample before the answer is in contact, and at the answer they are as
/// near as it says.
TEST(MovingTriangles, AreNeverInContactBeforeTheAnswer) {
    constexpr unsigned kSeed = 5;
    std::mt19937 random(kSeed);
    std::uniform_real_distribution<double> u(-1, 1);
    const auto triangle = [&] {
        const Vec3d middle(u(random), u(random), u(random));
        Triangle t;
        for (Vec3d& p : t) p = middle + 0.8 * Vec3d(u(random), u(random), u(random));
        // Some are segments, some points.
        if (u(random) > 0.9) t[2] = t[1];
        if (u(random) > 0.95) t[1] = t[2] = t[0];
        return t;
    };
    const auto at = [](const Triangle& start, const Triangle& end, double t) {
        Triangle out;
        for (std::size_t i = 0; i < 3; ++i) out[i] = (1 - t) * start[i] + t * end[i];
        return out;
    };
    int hits = 0;
    for (int trial = 0; trial < 3000; ++trial) {
        const Triangle a0 = triangle(), a1 = triangle(), b0 = triangle(), b1 = triangle();
        const ElementaryImpact found = trianglesImpact(a0, a1, b0, b1, {.tolerance = 1e-5});
        const auto again = [&] { return testing::Message() << "seed " << kSeed << ", trial " << trial; };
        ASSERT_TRUE(found.complete) << again();
        constexpr int kSamples = 200;
        for (int i = 0; i <= kSamples; ++i) {
            const double t = static_cast<double>(i) / kSamples;
            if (found.hit && t >= found.t) break;
            ASSERT_FALSE(trianglesIntersect(at(a0, a1, t), at(b0, b1, t))) << again() << ", sample " << t;
        }
        if (!found.hit) continue;
        ++hits;
        const Triangle a = at(a0, a1, found.t), b = at(b0, b1, found.t);
        ASSERT_TRUE(nearestPoints(a, b).distance <= 1e-5 || trianglesIntersect(a, b)) << again();
        ASSERT_NEAR((found.onA - found.onB).norm(), found.distance, 1e-12) << again();
        const ElementaryImpact swapped = trianglesImpact(b0, b1, a0, a1, {.tolerance = 1e-5});
        ASSERT_TRUE(swapped.hit) << again();
    }
    EXPECT_GT(hits, 600);
    EXPECT_LT(hits, 2400);
}

/// Of the fifteen elementary pairs the first to meet is the triangles' contact.
TEST(MovingTriangles, MeetWhenTheFirstOfTheirPartsDo) {
    constexpr unsigned kSeed = 6;
    std::mt19937 random(kSeed);
    std::uniform_real_distribution<double> u(-1, 1);
    const auto triangle = [&](double z) {
        Triangle t;
        for (Vec3d& p : t) p = Vec3d(u(random), u(random), z + 0.3 * u(random));
        return t;
    };
    const ElementaryOptions options{.tolerance = 1e-8};
    int hits = 0;
    for (int trial = 0; trial < 500; ++trial) {
        const Triangle a0 = triangle(-1), a1 = triangle(1), b0 = triangle(1), b1 = triangle(-1);
        double first = 2;
        const auto offer = [&](const ElementaryImpact& part) {
            if (part.hit) first = std::min(first, part.t);
        };
        for (std::size_t i = 0; i < 3; ++i) {
            offer(vertexFaceImpact(a0[i], a1[i], b0, b1, options));
            offer(vertexFaceImpact(b0[i], b1[i], a0, a1, options));
            for (std::size_t j = 0; j < 3; ++j)
                offer(edgeEdgeImpact({a0[i], a0[(i + 1) % 3]}, {a1[i], a1[(i + 1) % 3]}, {b0[j], b0[(j + 1) % 3]},
                                     {b1[j], b1[(j + 1) % 3]}, options));
        }
        const ElementaryImpact whole = trianglesImpact(a0, a1, b0, b1, options);
        ASSERT_EQ(whole.hit, first <= 1) << "seed " << kSeed << ", trial " << trial;
        if (!whole.hit) continue;
        ++hits;
        ASSERT_NEAR(whole.t, first, 1e-6) << "seed " << kSeed << ", trial " << trial;
    }
    EXPECT_GT(hits, 100);
}

/// A corner stands beside the long edge of a floor, in its plane, as near as some hundred roundings: the way to it lies
/// in the plane too, and not in some other direction that parts the two as well.
TEST(DirectionApart, OfACornerBesideALongEdgeIsSquareToTheEdge) {
    constexpr unsigned kSeed = 7;
    std::mt19937 random(kSeed);
    std::uniform_real_distribution<double> u(-1, 1);
    for (int trial = 0; trial < 2000; ++trial) {
        const Quatd turn = Quatd(u(random), u(random), u(random), u(random)).normalized();
        Triangle floor{Vec3d(-2, 0, 0), Vec3d(2, 0, 0), Vec3d(2, 3, 0)};
        const Vec3d corner(u(random), -3e-13, 0);
        Triangle above{corner, corner + 0.03 * Vec3d(u(random), u(random) - 1, 1),
                       corner + 0.03 * Vec3d(u(random), u(random) - 1, 1)};
        for (Triangle* t : {&floor, &above})
            for (Vec3d& p : *t) p = turn * (p + Vec3d(1, -2, 3));
        const Vec3d n = directionApart(floor, above, nearestPoints(floor, above));
        // Places are known to a hundredth of the gap or so.
        ASSERT_LT((turn.conjugate() * n - Vec3d(0, -1, 0)).norm(), 0.2) << "seed " << kSeed << ", trial " << trial;
    }
}

}  // namespace
}  // namespace tessera
