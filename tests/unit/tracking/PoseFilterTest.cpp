/// The filter beside motions whose truth is a formula, and beside poses that nobody can have.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "TrackerBytes.h"
#include "server/sim/tracking/PoseFilter.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;
using Verdict = PoseFilter::Verdict;

constexpr TimePoint kBegin = TimePoint{} + 1000s;
TimePoint atSecond(double seconds) {
    return kBegin + std::chrono::nanoseconds(std::llround(1e9 * seconds));
}

struct Noise {
    Noise(unsigned seed, double millimetres) : random(seed), along(0, millimetres / 1000) {}
    Vec3d operator()() { return {along(random), along(random), along(random)}; }
    std::mt19937 random;
    std::normal_distribution<double> along;
};

/// Poses 60 times a second for ten seconds; the greatest and the mean square distance from the truth `ahead` later,
/// from the third second on.
struct FilterErrors {
    double rms = 0, worst = 0, rawRms = 0;
};
template <typename Truth>
FilterErrors follow(const TrackerFilter& settings, Truth truth, double noiseMm, double ahead, unsigned seed) {
    PoseFilter filter(settings);
    Noise noise(seed, noiseMm);
    double squares = 0, rawSquares = 0;
    int count = 0;
    FilterErrors errors;
    for (double t = 0; t < 10; t += 1.0 / 60) {
        const Vec3d measured = truth(t) + noise();
        EXPECT_EQ(filter.add(atSecond(t), {.position = measured}), Verdict::kTaken);
        if (t < 3) continue;
        const double off = (filter.at(atSecond(t + ahead)).position - truth(t + ahead)).norm();
        squares += off * off;
        rawSquares += (measured - truth(t + ahead)).squaredNorm();
        errors.worst = std::max(errors.worst, off);
        ++count;
    }
    errors.rms = std::sqrt(squares / count);
    errors.rawRms = std::sqrt(rawSquares / count);
    return errors;
}

TEST(PoseFilter, IsQuieterThanItsTrackerAtRestAndNearerInMotion) {
    const unsigned seed = test::trackerSeed(5);
    TESSERA_TRACKER_SEED(seed, "PoseFilter.IsQuieter*");
    for (unsigned s = seed; s < seed + 20; ++s) {
        const FilterErrors rest = follow(
            {}, [](double) { return Vec3d(0, 1.7, 2); }, 0.5, 0.033, s);
        EXPECT_LT(rest.rms, 0.85 * rest.rawRms) << s;
        const FilterErrors sway = follow(
            {}, [](double t) { return Vec3d(0.3 * std::sin(3.1 * t), 1.7, 2 + 0.1 * std::sin(7 * t)); }, 0.5, 0.033, s);
        EXPECT_LT(sway.rms, 0.3 * sway.rawRms) << s;
    }
}

TEST(PoseFilter, CarriesAnEvenMotionToWhereItWillBe) {
    const FilterErrors even = follow(
        {}, [](double t) { return Vec3d(0.8 * t - 4, 1.7, 0.2 * t); }, 0, 0.05, 1);
    EXPECT_LT(even.worst, 1e-3);
    PoseFilter filter{TrackerFilter()};
    for (double t = 0; t < 2; t += 1.0 / 60)
        (void)filter.add(atSecond(t), {.orientation = Quatd(Eigen::AngleAxisd(1.5 * t, Vec3d(0, 0.6, 0.8)))});
    const double last = std::chrono::duration<double>(filter.last() - kBegin).count();
    EXPECT_LT(filter.at(atSecond(last + 0.04))
                  .orientation.angularDistance(Quatd(Eigen::AngleAxisd(1.5 * (last + 0.04), Vec3d(0, 0.6, 0.8)))),
              0.005);
}

TEST(PoseFilter, PredictsNoFartherThanItMay) {
    TrackerFilter settings;
    settings.longestPrediction = 20ms;
    PoseFilter filter(settings);
    for (double t = 0; t < 2; t += 1.0 / 60) (void)filter.add(atSecond(t), {.position = Vec3d(t, 0, 0)});
    EXPECT_EQ(filter.at(filter.last() + 20ms).position, filter.at(filter.last() + 10s).position);
    EXPECT_LT(filter.at(filter.last() - 1s).position.x(), filter.at(filter.last() + 1ms).position.x());
}

/// After a stop from full speed the place shown comes back to the truth, and is never farther beyond it than the head
/// could have gone within the time that is predicted.
TEST(PoseFilter, OvershootsNoMoreThanItPredicts) {
    for (const double speed : {0.3, 1.0, 2.0}) {
        PoseFilter filter{TrackerFilter()};
        double beyond = 0, after = 0;
        for (double t = 0; t < 3; t += 1.0 / 60) {
            const double truth = speed * std::min(t, 1.5);
            (void)filter.add(atSecond(t), {.position = Vec3d(truth, 0, 0)});
            const double shown = filter.at(atSecond(t + 0.033)).position.x();
            if (t > 1.5) beyond = std::max(beyond, shown - 1.5 * speed);
            if (t > 2.2) after = std::max(after, std::abs(shown - 1.5 * speed));
        }
        EXPECT_LT(beyond, speed * (0.033 + 2.0 / 60)) << speed;
        EXPECT_LT(after, 0.005 * speed + 0.001) << speed;
    }
}

TEST(PoseFilter, RefusesWhatIsNoPose) {
    const double nan = std::numeric_limits<double>::quiet_NaN(), infinite = std::numeric_limits<double>::infinity();
    PoseFilter filter{TrackerFilter()};
    for (const bool begun : {false, true}) {
        for (const RawPose& pose :
             {RawPose{.position = {nan, 0, 0}}, RawPose{.position = {0, infinite, 0}}, RawPose{.position = {0, 0, 1e9}},
              RawPose{.orientation = Quatd(0, 0, 0, 0)}, RawPose{.orientation = Quatd(nan, 0, 0, 1)},
              RawPose{.orientation = Quatd(1e300, 0, 0, 0)}})
            EXPECT_EQ(filter.add(kBegin + 1s, pose), Verdict::kNoPose);
        EXPECT_EQ(filter.any(), begun);
        EXPECT_EQ(filter.add(kBegin + 1s, {.orientation = Quatd(2, 0, 0, 0)}), Verdict::kTaken);
    }
    EXPECT_NEAR(filter.at(kBegin + 1s).orientation.norm(), 1, 1e-12);
}

TEST(PoseFilter, DoesNotBelieveAJumpUntilItStays) {
    PoseFilter filter{TrackerFilter()};
    double t = 0;
    const auto next = [&](const Vec3d& position, const Quatd& turn = Quatd::Identity()) {
        return filter.add(atSecond(t += 1.0 / 60), {.position = position, .orientation = turn});
    };
    for (int i = 0; i < 60; ++i) EXPECT_EQ(next({0, 1.7, 2}), Verdict::kTaken);
    EXPECT_EQ(next({3, 1.7, 2}), Verdict::kOutlier);
    EXPECT_EQ(next({0, 1.7, 2}), Verdict::kTaken);
    EXPECT_EQ(next({3, 1.7, 2}), Verdict::kOutlier);
    EXPECT_EQ(next({-3, 1.7, 2}), Verdict::kOutlier);  // elsewhere again
    EXPECT_EQ(next({3, 1.7, 2}), Verdict::kOutlier);
    EXPECT_LT(filter.at(filter.last() + 30ms).position.x(), 0.01);
    EXPECT_EQ(next({3.01, 1.7, 2}), Verdict::kOutlier);
    EXPECT_EQ(next({3.02, 1.7, 2}), Verdict::kTaken);  // three near each other
    EXPECT_NEAR(filter.at(filter.last()).position.x(), 3.02, 1e-9);
    EXPECT_EQ(next({3.02, 1.7, 2}, Quatd(Eigen::AngleAxisd(3, Vec3d::UnitY()))),
              Verdict::kOutlier);  // a body that flips
}

TEST(PoseFilter, BeginsAnewAfterAGap) {
    PoseFilter filter{TrackerFilter()};
    for (double t = 0; t < 1; t += 1.0 / 60) (void)filter.add(atSecond(t), {.position = Vec3d(t, 0, 0)});
    EXPECT_EQ(filter.add(atSecond(2), {.position = Vec3d(-40, 0, 0)}), Verdict::kTaken);
    EXPECT_EQ(filter.at(atSecond(2.05)).position, Vec3d(-40, 0, 0));
}

/// Whatever times and numbers come, what comes out is a pose; and the same again for the same.
TEST(PoseFilter, IsDeterministicAndFiniteForAnyTimesAndPoses) {
    const unsigned seed = test::trackerSeed(6);
    TESSERA_TRACKER_SEED(seed, "PoseFilter.IsDeterministic*");
    for (unsigned s = seed; s < seed + 300; ++s) {
        std::mt19937 random(s);
        PoseFilter one{TrackerFilter()}, two{TrackerFilter()};
        TimePoint at = kBegin;
        for (int i = 0; i < 300; ++i) {
            at += std::chrono::nanoseconds(random() % (random() % 3 == 0 ? 10 : 40'000'000));
            test::SentPose pose = test::randomPose(random);
            if (random() % 2 == 0) pose.position *= std::pow(10.0, static_cast<double>(random() % 30) - 15);
            const RawPose raw{.position = pose.position,
                              .orientation = pose.orientation,
                              .turns = random() % 4 != 0,
                              .placed = random() % 4 != 0};
            EXPECT_EQ(one.add(at, raw), two.add(at, raw));
            if (!one.any()) continue;
            const TimePoint when = at + std::chrono::milliseconds(random() % 1000);
            const RigidPose a = one.at(when), b = two.at(when);
            ASSERT_TRUE(a.position.allFinite()) << s;
            ASSERT_NEAR(a.orientation.norm(), 1, 1e-9) << s;
            EXPECT_EQ(a.position, b.position);
            EXPECT_EQ(a.orientation.coeffs(), b.orientation.coeffs());
        }
    }
}

TEST(PoseFilter, OffIsThePoseAsItCame) {
    TrackerFilter settings;
    settings.enabled = false;
    PoseFilter filter(settings);
    Noise noise(1, 5);
    for (double t = 0; t < 1; t += 1.0 / 60) {
        const Vec3d place = Vec3d(t, 0, 0) + noise();
        (void)filter.add(atSecond(t), {.position = place});
        EXPECT_EQ(filter.at(atSecond(t + 0.05)).position, place);
    }
}

}  // namespace
}  // namespace tessera
