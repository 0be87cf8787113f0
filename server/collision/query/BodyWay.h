/// Where the points of a body on its way are at a moment, how fast they go, and how much that can change.
#pragma once

#include "server/collision/query/TimeOfImpact.h"

namespace tessera {

/// Positions and velocities of a body's points x: linear·x + translation, turning·x + drift (per unit of time).
struct BodyMoment {
    Mat3d linear = Mat3d::Identity();
    Vec3d translation = Vec3d::Zero();
    Mat3d turning = Mat3d::Zero();
    Vec3d drift = Vec3d::Zero();

    [[nodiscard]] Vec3d place(const Vec3d& x) const { return linear * x + translation; }
    [[nodiscard]] Vec3d velocity(const Vec3d& x) const { return turning * x + drift; }
};

/// x(t) = T(t) + R(t)·S(t)·M·x; T and S linear, R(t) = exp(t [ω]) R(0) with a constant ω, as a slerp is; M, the body's own
/// map of its mesh, does not change.
class BodyWay {
public:
    explicit BodyWay(const BodyMotion& motion);

    /// All numbers finite, rotations that are some.
    [[nodiscard]] bool valid() const { return valid_; }
    [[nodiscard]] BodyMoment at(double t) const;
    [[nodiscard]] Quatd rotationAt(double t) const;
    /// No length is stretched by more at a moment.
    [[nodiscard]] double stretchAt(double t) const {
        return (scale0_ + t * scale_).cwiseAbs().maxCoeff() * innerStretch_;
    }
    /// Of a similarity, with a sign.
    [[nodiscard]] double scaleAt(double t) const { return (scale0_.x() + t * scale_.x()) * innerScale_; }

    /// How far from the body's origin M puts a point, and all points within `radius` of one.
    [[nodiscard]] double reachOf(const Vec3d& x) const { return inner_ ? (innerLinear_ * x + innerShift_).norm() : x.norm(); }
    [[nodiscard]] double reachAround(const Vec3d& x, double radius) const {
        return reachOf(x) + innerStretch_ * radius;
    }

    /// Of x'' for points within `reach` of the body's origin, over the whole way: |R''| = ω², |R'| = ω, S'' = T'' = 0. It
    /// is square to the axis at any moment, for both of its parts are.
    [[nodiscard]] double acceleration(double reach) const {
        return (angle_ * angle_ * stretch_ + 2 * angle_ * swelling_) * reach;
    }
    /// About which it turns, in the shared frame; of unit length.
    [[nodiscard]] const Vec3d& axis() const { return axis_; }
    /// By how much, in all.
    [[nodiscard]] double angle() const { return angle_; }
    /// Of the origin, over the whole way.
    [[nodiscard]] const Vec3d& shift() const { return shift_; }
    /// How fast points within `reach` of the body's origin can go along a unit direction beside the origin, at most.
    [[nodiscard]] double sweep(const Vec3d& n, double reach) const {
        return (angle_ * stretch_ * n.cross(axis_).norm() + swelling_) * reach;
    }
    /// Translation alone.
    [[nodiscard]] bool straight() const { return angle_ == 0 && swelling_ == 0; }
    /// No length is stretched by more over the whole way.
    [[nodiscard]] double stretch() const { return stretch_ * innerStretch_; }
    /// A bound of |(S M)'|.
    [[nodiscard]] double swelling() const { return swelling_ * innerStretch_; }
    /// A bound of |(R S M)'|.
    [[nodiscard]] double turn() const { return (angle_ * stretch_ + swelling_) * innerStretch_; }
    /// The same scale along all axes, but for signs, at any moment.
    [[nodiscard]] bool similarity() const { return similarity_; }
    /// No number that arises from a point within `reach` of the mesh's origin is larger, over the whole way.
    [[nodiscard]] double extent(double reach) const;

private:
    Quatd start_;
    Vec3d axis_ = Vec3d::UnitX();
    double angle_ = 0;
    Mat3d r_, kr_, kkr_;  ///< R(0), [axis] R(0), [axis]² R(0): Rodrigues' formula
    Vec3d shift0_, shift_, scale0_, scale_;
    double stretch_ = 1, swelling_ = 0;
    Mat3d innerLinear_ = Mat3d::Identity();
    Vec3d innerShift_ = Vec3d::Zero();
    double innerStretch_ = 1;  ///< a bound of |M|
    double innerScale_ = 1;    ///< of an M that is a similarity
    bool inner_ = false;       ///< M is not the identity
    bool valid_ = false, similarity_ = true;
};

}  // namespace tessera
