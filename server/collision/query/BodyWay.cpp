#include "server/collision/query/BodyWay.h"

#include <algorithm>
#include <cmath>

namespace tessera {
namespace {

Mat3d crossMatrix(const Vec3d& v) {
    Mat3d m;
    m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
    return m;
}

bool usable(const Pose& pose) {
    const double norm = pose.rotation.coeffs().norm();
    return pose.translation.allFinite() && pose.scale.allFinite() && std::isfinite(norm) && norm > 1e-100;
}

bool uniform(const Vec3d& scale) {
    const Vec3d size = scale.cwiseAbs();
    return size.x() == size.y() && size.y() == size.z();
}

/// A bound of |m|: the root of the largest row sum of mᵀm, which is exact for rotations and uniform scales.
double stretchOf(const Mat3d& m) {
    const Mat3d square = m.transpose() * m;
    return std::sqrt(square.cwiseAbs().rowwise().sum().maxCoeff()) * (1 + 1e-12);
}

/// Of a map that turns, mirrors and scales evenly: the scale. 0 of any other.
double evenScale(const Mat3d& m) {
    const Mat3d square = m.transpose() * m;
    const double s2 = square.trace() / 3;
    // What the kernels' floats cannot tell from even.
    return (square - s2 * Mat3d::Identity()).cwiseAbs().maxCoeff() <= 1e-9 * s2 ? std::sqrt(s2) : 0;
}

}  // namespace

BodyWay::BodyWay(const BodyMotion& motion) {
    valid_ = usable(motion.start) && usable(motion.end) && motion.body_T_mesh.matrix().allFinite();
    if (!valid_) return;
    start_ = motion.start.rotation.normalized();
    Quatd end = motion.end.rotation.normalized();
    if (start_.dot(end) < 0) end.coeffs() = -end.coeffs();  // the shorter arc
    const bool turns = start_.coeffs() != end.coeffs();
    const Quatd turn = turns ? end * start_.conjugate() : Quatd::Identity();
    const double sine = turn.vec().norm();
    if (sine > 0) {
        axis_ = turn.vec() / sine;
        angle_ = 2 * std::atan2(sine, turn.w());
    }
    r_ = start_.toRotationMatrix();
    kr_ = crossMatrix(axis_) * r_;
    kkr_ = crossMatrix(axis_) * kr_;
    shift0_ = motion.start.translation;
    shift_ = motion.end.translation - shift0_;
    scale0_ = motion.start.scale;
    scale_ = motion.end.scale - scale0_;
    stretch_ = std::max(motion.start.scale.cwiseAbs().maxCoeff(), motion.end.scale.cwiseAbs().maxCoeff());
    swelling_ = scale_.cwiseAbs().maxCoeff();
    // Of a scale that turns inside out on the way the three would have to pass zero together.
    similarity_ = uniform(motion.start.scale) && uniform(motion.end.scale) && uniform(scale_);
    innerLinear_ = motion.body_T_mesh.linear();
    innerShift_ = motion.body_T_mesh.translation();
    inner_ = innerLinear_ != Mat3d::Identity() || innerShift_ != Vec3d::Zero();
    if (!inner_) return;
    innerStretch_ = stretchOf(innerLinear_);
    innerScale_ = evenScale(innerLinear_);
    similarity_ = similarity_ && innerScale_ > 0;
}

Quatd BodyWay::rotationAt(double t) const {
    return Quatd(Eigen::AngleAxisd(t * angle_, axis_)) * start_;
}

BodyMoment BodyWay::at(double t) const {
    BodyMoment m;
    const double s = std::sin(0.5 * t * angle_), c = std::cos(0.5 * t * angle_);
    const double sine = 2 * s * c, versine = 2 * s * s;
    const Vec3d scale = scale0_ + t * scale_;
    const Mat3d rotation = r_ + sine * kr_ + versine * kkr_;
    const Mat3d rate = angle_ * ((1 - versine) * kr_ + sine * kkr_);
    m.linear = rotation * scale.asDiagonal();
    m.translation = shift0_ + t * shift_;
    m.turning = rate * scale.asDiagonal();
    m.turning += rotation * scale_.asDiagonal();
    m.drift = shift_;
    if (inner_) {
        m.translation += m.linear * innerShift_;
        m.drift += m.turning * innerShift_;
        m.linear *= innerLinear_;
        m.turning *= innerLinear_;
    }
    return m;
}

double BodyWay::extent(double reach) const {
    return std::max(shift0_.cwiseAbs().maxCoeff(), (shift0_ + shift_).cwiseAbs().maxCoeff()) +
           stretch_ * (innerStretch_ * reach + innerShift_.norm());
}

Pose BodyMotion::at(double t) const {
    if (t <= 0) return start;
    if (t >= 1) return end;
    const BodyWay way(*this);
    return {start.translation + t * (end.translation - start.translation), way.rotationAt(t),
            start.scale + t * (end.scale - start.scale)};
}

}  // namespace tessera
