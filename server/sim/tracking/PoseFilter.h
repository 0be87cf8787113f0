/// Smooths one sensor's poses and carries them to the instant at which they are shown.
///
/// A Kalman filter of constant velocity (R. Kalman 1960; Bar-Shalom, Li, Kirubarajan, "Estimation with Applications to
/// Tracking and Navigation", 2001, ch. 6) for the place, and the same on the tangent of the quaternion for the
/// rotation. Noise is alike along all axes, so one covariance of two by two serves three. How much acceleration is
/// believed in follows what the last poses say: little at rest, which is quiet, and at once much where poses leave the
/// path. README.md has what it was chosen by.
#pragma once

#include <optional>

#include "common/base/Clock.h"
#include "server/sim/tracking/SensorReport.h"

namespace tessera {

/// One vector's velocity, and how much of a surprise is believed. Units are the caller's: metres, or radians.
class RateFilter {
public:
    /// `jitter`: standard deviation of a measurement along one axis. `quiet`, `wild`: least and most acceleration
    /// believed in.
    RateFilter(double jitter, double quiet, double wild) : jitter_(jitter), quiet_(quiet), wild_(wild) {}

    void restart();
    /// What the value takes of the difference between measured and expected (value + rate·dt), dt seconds later.
    [[nodiscard]] Vec3d correct(double dt, const Vec3d& surprise);
    [[nodiscard]] const Vec3d& rate() const { return rate_; }

private:
    double jitter_, quiet_, wild_;
    double acceleration_ = 0;
    Vec3d rate_ = Vec3d::Zero();
    Vec3d trend_ = Vec3d::Zero();  ///< of the last surprises, each by what it should be at most
    double p00_ = 0, p01_ = 0, p11_ = 0;
};

/// Where and how; in the wall's frame when the caller's poses are.
struct RigidPose {
    Vec3d position = Vec3d::Zero();
    Quatd orientation = Quatd::Identity();
};

/// Deterministic: the same times and poses give the same answers. Not thread-safe.
class PoseFilter {
public:
    enum class Verdict : std::uint8_t {
        kTaken,
        kNoPose,   ///< numbers that are not finite, a quaternion without a length, a place a kilometre away
        kOutlier,  ///< farther away than anybody moves; believed where three in a row agree
    };
    /// A gap after which nothing of the past counts.
    static constexpr std::chrono::milliseconds kForgetAfter{250};

    explicit PoseFilter(const TrackerFilter& settings);

    /// `at` never runs back. Metres. A pose that says no rotation, or no place, leaves the other as it is.
    Verdict add(TimePoint at, const RawPose& pose);

    [[nodiscard]] bool any() const { return last_.has_value(); }
    /// Where it should be at `when`, at most `longestPrediction` beyond the last pose. Only with `any`.
    [[nodiscard]] RigidPose at(TimePoint when) const;
    [[nodiscard]] TimePoint last() const { return *last_; }
    /// What poses stray from where they were expected, along one axis, of late: metres.
    [[nodiscard]] double strays() const { return strays_; }

private:
    void restart(TimePoint at, const RawPose& pose);

    TrackerFilter settings_;
    std::optional<TimePoint> last_;
    RigidPose value_;
    RateFilter position_, rotation_;
    double strays_ = 0;
    int outliers_ = 0;  ///< in a row, near each other
    RawPose outlier_;
};

}  // namespace tessera
