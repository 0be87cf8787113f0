#include "server/sim/frame/Motions.h"

#include <gtest/gtest.h>

#include <limits>

namespace tessera {
namespace {

std::vector<double> keys(std::initializer_list<std::pair<double, double>> timeAndX) {
    std::vector<double> all;
    for (const auto& [t, x] : timeAndX)
        for (const double v : {t, x, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0}) all.push_back(v);
    return all;
}

TEST(Motions, InterpolateLinearlyBetweenKeysAndStandStillOutside) {
    const auto k = keys({{1, 10}, {2, 20}, {4, 0}});
    EXPECT_EQ(poseAt(k, Motion::kOnce, 0).translation.x(), 10);
    EXPECT_EQ(poseAt(k, Motion::kOnce, 1.5).translation.x(), 15);
    EXPECT_EQ(poseAt(k, Motion::kOnce, 3).translation.x(), 10);
    EXPECT_EQ(poseAt(k, Motion::kOnce, 9).translation.x(), 0);
}

TEST(Motions, LoopStartsOverAndPingPongComesBack) {
    const auto k = keys({{0, 0}, {2, 8}});
    EXPECT_DOUBLE_EQ(poseAt(k, Motion::kLoop, 2.5).translation.x(), 2);
    EXPECT_DOUBLE_EQ(poseAt(k, Motion::kPingPong, 2.5).translation.x(), 6);
    EXPECT_DOUBLE_EQ(poseAt(k, Motion::kPingPong, 4.5).translation.x(), 2);
}

TEST(Motions, RotateAlongTheShorterArc) {
    std::vector<double> k = keys({{0, 0}, {1, 0}});
    const Quatd quarter(Eigen::AngleAxisd(1.5, Vec3d::UnitY()));
    // The same rotation with the sign turned: the long way round for a naive interpolation.
    const double q[4] = {-quarter.w(), -quarter.x(), -quarter.y(), -quarter.z()};
    std::copy(q, q + 4, k.begin() + kScalarsPerKey + 4);
    const Quatd half = poseAt(k, Motion::kOnce, 0.5).rotation;
    EXPECT_NEAR(half.angularDistance(Quatd(Eigen::AngleAxisd(0.75, Vec3d::UnitY()))), 0, 1e-12);
}

TEST(Motions, UnsoundKeysAreExplained) {
    EXPECT_FALSE(checkKeys({}));
    std::vector<double> k = keys({{0, 0}, {1, 1}});
    EXPECT_TRUE(checkKeys(k));
    EXPECT_NE(checkKeys(std::span(k).first(12)).error().message.find("whole number"), std::string::npos);
    std::vector<double> backwards = keys({{1, 0}, {1, 1}});
    EXPECT_NE(checkKeys(backwards).error().message.find("not later"), std::string::npos);
    std::vector<double> nan = k;
    nan[1] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_NE(checkKeys(nan).error().message.find("not finite"), std::string::npos);
    std::vector<double> zero = k;
    zero[4] = 0;
    EXPECT_NE(checkKeys(zero).error().message.find("rotation"), std::string::npos);
}

}  // namespace
}  // namespace tessera
