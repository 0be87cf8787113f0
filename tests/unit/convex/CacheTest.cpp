#include <gtest/gtest.h>

#include "server/collision/convex/ConvexQuery.h"
#include "tests/unit/convex/ConvexShapes.h"

namespace tessera {
namespace {

using convextest::hullOf;
using convextest::Points;
using convextest::Random;

/// B circles around A and tumbles, a little per frame, now apart from it and now in it.
Affine3d poseAt(int frame) {
    const double t = 0.005 * frame;
    return Eigen::Translation3d((2.4 + 0.8 * std::sin(0.7 * t)) *
                                Vec3d(std::cos(t), std::sin(t), 0.3 * std::sin(2 * t))) *
           Eigen::AngleAxisd(1.3 * t, Vec3d(1, 2, 3).normalized()) * Affine3d::Identity();
}

struct Supports {
    double cold = 0, warm = 0;  ///< per frame
};

template <typename Query>
Supports compare(const Query& query) {
    constexpr int kFrames = 2000;
    ConvexWork cold, warm;
    ConvexCache cache;
    for (int frame = 0; frame < kFrames; ++frame) query(poseAt(frame), cold, warm, cache);
    return {double(cold.supports) / kFrames, double(warm.supports) / kFrames};
}

class Bodies : public testing::TestWithParam<int> {};

ConvexHull body(int kind) {
    Random random(static_cast<std::uint64_t>(kind));
    return hullOf(kind == 0   ? convextest::box(Vec3d(2, 2, 2))
                  : kind == 1 ? convextest::sphere(1.2, 2000)
                              : convextest::cloud(60, random));
}

TEST_P(Bodies, AFrameAfterAnotherCostsFewSupports) {
    const ConvexHull a = body(GetParam()), b = body((GetParam() + 1) % 3);
    int met = 0;
    const Supports touching = compare([&](const Affine3d& m, ConvexWork& cold, ConvexWork& warm, ConvexCache& cache) {
        const Touch truth = hullsTouching(a, b, m, cold);
        ASSERT_EQ(hullsTouching(a, b, m, warm, &cache), truth);
        met += truth == Touch::kYes;
    });
    EXPECT_GT(met, 100);
    EXPECT_LT(met, 1900);
    EXPECT_LT(touching.warm, 1.1)
        << "one says that the plane of the last frame still parts them; none that it does not";
    EXPECT_LT(touching.warm, 0.5 * touching.cold);
    const Supports distance = compare([&](const Affine3d& m, ConvexWork& cold, ConvexWork& warm, ConvexCache& cache) {
        ASSERT_NEAR(hullDistance(a, b, m, cold).distance, hullDistance(a, b, m, warm, &cache).distance, 1e-13);
    });
    EXPECT_LT(distance.warm, 1.5);
    EXPECT_LT(distance.warm, 0.4 * distance.cold);
    RecordProperty("touching_cold", std::to_string(touching.cold));
    RecordProperty("touching_warm", std::to_string(touching.warm));
    RecordProperty("distance_cold", std::to_string(distance.cold));
    RecordProperty("distance_warm", std::to_string(distance.warm));
}

INSTANTIATE_TEST_SUITE_P(Kinds, Bodies, testing::Range(0, 3));

TEST(ConvexCache, AtRestCostsOneSupportOrNone) {
    const ConvexHull a = hullOf(convextest::sphere(1, 500));
    for (const double x : {1.2, 3.0}) {
        const Affine3d m(Eigen::Translation3d(x, 0.3, 0.2));
        ConvexCache cache;
        ConvexWork first, second;
        const HullDistance d = hullDistance(a, a, m, first, &cache);
        const HullDistance again = hullDistance(a, a, m, second, &cache);
        EXPECT_NEAR(d.distance, again.distance, 1e-15);
        EXPECT_LE(second.supports, x < 2 ? 0u : 1u);
        EXPECT_LT(second.looks, 40u) << "the climb begins where the last one ended";
        EXPECT_GT(first.supports, 2u);
    }
}

TEST(ConvexCache, OfOtherHullsDoesNoHarm) {
    Random random(4);
    ConvexCache cache;
    for (int i = 0; i < 500; ++i) {
        const ConvexHull a = hullOf(convextest::anyBody(i, random)), b = hullOf(convextest::anyBody(i / 3, random));
        const Affine3d m =
            Affine3d(Eigen::Translation3d(2 * convextest::normalVector(random))) * convextest::rotation(random);
        ConvexWork work;
        const HullDistance cold = hullDistance(a, b, m, work), warm = hullDistance(a, b, m, work, &cache);
        ASSERT_NEAR(cold.distance, warm.distance, 1e-13 * (1 + cold.distance));
        ASSERT_EQ(cold.distance == 0, warm.distance == 0);
    }
}

}  // namespace
}  // namespace tessera
