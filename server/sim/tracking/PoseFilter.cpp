#include "server/sim/tracking/PoseFilter.h"

#include <algorithm>
#include <cmath>

namespace tessera {

namespace {

// What heads and hands do: metres and radians per second squared. Found by `bench_tracking`.
constexpr double kQuietMetres = 0.05, kWildMetres = 15, kQuietRadians = 0.2, kWildRadians = 60;
constexpr double kFarthestMetres = 1000;
constexpr double kJumpRadians = 1.2;
constexpr int kBelievedOutliers = 3;
constexpr double kShortestStep = 0.0005, kUnknownRate = 1.0;

double seconds(Duration duration) {
    return std::chrono::duration<double>(duration).count();
}

/// The rotation vector of a quaternion of length 1, the short way.
Vec3d logOf(const Quatd& q) {
    const double sign = q.w() < 0 ? -1 : 1;
    const Vec3d v = sign * q.vec();
    const double sine = v.norm();
    if (sine < 1e-12) return 2 * v;
    return 2 * std::atan2(sine, sign * q.w()) / sine * v;
}
Quatd expOf(const Vec3d& v) {
    const double angle = v.norm();
    if (angle < 1e-12) return Quatd(1, v.x() / 2, v.y() / 2, v.z() / 2).normalized();
    return Quatd(Eigen::AngleAxisd(angle, v / angle));
}

}  // namespace

void RateFilter::restart() {
    rate_.setZero();
    trend_.setZero();
    acceleration_ = wild_;
    p00_ = jitter_ * jitter_;
    p01_ = 0;
    p11_ = kUnknownRate;
}

Vec3d RateFilter::correct(double dt, const Vec3d& surprise) {
    // How far beyond what noise and the present belief explain: surprises of one direction count, those to and fro do
    // not.
    const double noise = jitter_ * jitter_;
    const double expected = std::sqrt(p00_ + 2 * dt * p01_ + dt * dt * p11_ + noise);
    trend_ = 0.5 * trend_ + 0.5 * surprise / expected;
    const double excess = trend_.norm() - 1.3;
    const double wanted = excess > 0 ? acceleration_ * (1 + 4 * excess) + quiet_ : acceleration_ * std::exp(-dt / 0.15);
    acceleration_ = std::clamp(wanted, quiet_, wild_);

    const double q = acceleration_ * acceleration_;
    p00_ += 2 * dt * p01_ + dt * dt * p11_ + q * dt * dt * dt * dt / 4;
    p01_ += dt * p11_ + q * dt * dt * dt / 2;
    p11_ += q * dt * dt;
    const double whole = p00_ + noise;
    const double k0 = p00_ / whole, k1 = p01_ / whole;
    p11_ -= k1 * p01_;
    p01_ *= 1 - k0;
    p00_ *= 1 - k0;
    rate_ += k1 * surprise;
    return k0 * surprise;
}

PoseFilter::PoseFilter(const TrackerFilter& settings)
    : settings_(settings),
      position_(settings.jitterMillimetres / 1000, kQuietMetres, kWildMetres),
      rotation_(settings.jitterDegrees / 57.29577951308232, kQuietRadians, kWildRadians) {}

void PoseFilter::restart(TimePoint at, const RawPose& pose) {
    if (pose.placed) value_.position = pose.position;
    if (pose.turns) value_.orientation = pose.orientation;
    position_.restart();
    rotation_.restart();
    last_ = at;
    outliers_ = 0;
}

PoseFilter::Verdict PoseFilter::add(TimePoint at, const RawPose& raw) {
    RawPose pose = raw;
    if (pose.placed && !(pose.position.cwiseAbs().maxCoeff() < kFarthestMetres && pose.position.allFinite()))
        return Verdict::kNoPose;
    if (pose.turns) {
        const double length = pose.orientation.norm();
        if (!(length > 0.1 && length < 10)) return Verdict::kNoPose;
        pose.orientation.coeffs() /= length;
    }
    if (!last_ || at - *last_ > kForgetAfter) {
        restart(at, pose);
        return Verdict::kTaken;
    }
    const double dt = std::max(seconds(at - *last_), kShortestStep);
    const Vec3d expected = value_.position + dt * position_.rate();
    const Quatd turned = value_.orientation * expOf(dt * rotation_.rate());
    const Vec3d away = pose.placed ? Vec3d(pose.position - expected) : Vec3d::Zero();
    const Vec3d turnedAway = pose.turns ? logOf(turned.conjugate() * pose.orientation) : Vec3d::Zero();
    if (away.norm() > settings_.jumpMetres || turnedAway.norm() > kJumpRadians) {
        const bool again = outliers_ > 0 && (pose.position - outlier_.position).norm() < settings_.jumpMetres &&
                           logOf(outlier_.orientation.conjugate() * pose.orientation).norm() < kJumpRadians;
        outliers_ = again ? outliers_ + 1 : 1;
        outlier_ = pose;
        if (outliers_ < kBelievedOutliers) return Verdict::kOutlier;
        restart(at, pose);
        return Verdict::kTaken;
    }
    outliers_ = 0;
    last_ = at;
    if (!settings_.enabled) {
        if (pose.placed) value_.position = pose.position;
        if (pose.turns) value_.orientation = pose.orientation;
        return Verdict::kTaken;
    }
    if (pose.placed) {
        strays_ = std::sqrt(0.95 * strays_ * strays_ + 0.05 * away.squaredNorm() / 3);
        value_.position = expected + position_.correct(dt, away);
    }
    if (pose.turns) value_.orientation = (turned * expOf(rotation_.correct(dt, turnedAway))).normalized();
    return Verdict::kTaken;
}

RigidPose PoseFilter::at(TimePoint when) const {
    if (!settings_.enabled) return value_;
    const double ahead = seconds(std::clamp<Duration>(when - *last_, Duration::zero(), settings_.longestPrediction));
    return {.position = value_.position + ahead * position_.rate(),
            .orientation = (value_.orientation * expOf(ahead * rotation_.rate())).normalized()};
}

}  // namespace tessera
