#include "server/collision/rigid_bodies/BodyPath.h"

#include <cmath>
#include <limits>

namespace tessera::rigid {

namespace {

constexpr double kStraight = 0.1;  ///< radians

Quatd halved(Quatd q) {
    q.w() += 1;
    q.normalize();
    return q;
}

Quatd straight(Quatd q, double t) {
    q.vec() *= t;
    q.w() = 1 - t + t * q.w();
    q.normalize();
    return q;
}

/// Of the straight line: 4 tan(angle / 4).
double rateOf(const Quatd& q) {
    return 4 * q.vec().norm() / (1 + q.w());
}

}  // namespace

BodyPath::BodyPath(const Vec3d& c, const Vec3d& m, const Quatd& q) : centre(c), moved(m), turned(q) {
    if (turned.w() < 0) turned.coeffs() = -turned.coeffs();
    rate = rateOf(turned);
    fine_ = rate < kStraight;
    if (fine_) return;
    half_ = halved(turned);
    quarter_ = halved(half_);
    eighth_ = halved(quarter_);
    rate = 8 * rateOf(eighth_);
}

Quatd BodyPath::turnAt(double t) const {
    if (t >= 1) return turned;
    if (fine_) return straight(turned, t);
    const int piece = static_cast<int>(8 * t);
    Quatd q = straight(eighth_, 8 * t - piece);
    if (piece & 4) q = half_ * q;
    if (piece & 2) q = quarter_ * q;
    if (piece & 1) q = eighth_ * q;
    return q.normalized();
}

Isometry3d BodyPath::at(double t) const {
    Isometry3d out = Isometry3d::Identity();
    if (t > 0 && rate > 0) out.linear() = turnAt(t).toRotationMatrix();
    out.translation() = centre + t * moved - out.linear() * centre;
    return out;
}

double BodyPath::strayedFrom(const BodyPath& other, double radius) const {
    constexpr double kLarge = 0.5;
    const double aside = (moved - other.moved).norm();
    if (!(rate > 0) && !(other.rate > 0)) return aside;
    if (rate > kLarge || other.rate > kLarge) return std::numeric_limits<double>::infinity();
    // Of half angles up to a quarter the vectors' difference is hardly less than half the rotations': 2 / cos(1/4).
    return aside + 2.2 * (turned.vec() - other.turned.vec()).norm() * radius;
}

void BodyPath::cut(double t) {
    *this = BodyPath(centre, t * moved, turnAt(t));
}

Quatd turnBy(const Vec3d& spin, double seconds) {
    // In eighths, each by the tangent of its half angle to the seventh order.
    const Vec3d half = 0.0625 * seconds * spin;
    const double square = half.squaredNorm();
    const double tangent = 1 + square * (1.0 / 3 + square * (2.0 / 15 + square * (17.0 / 315)));
    const Vec3d axis = tangent * half;
    Quatd out(1, axis.x(), axis.y(), axis.z());
    for (int i = 0; i < 3; ++i) {
        out.normalize();
        out = out * out;
    }
    out.normalize();
    return out;
}

}  // namespace tessera::rigid
