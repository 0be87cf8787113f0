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

/// x(t) = T(t) + R(t)·S(t)·x; T and S linear, R(t) = exp(t [ω]) R(0) with a constant ω, as a slerp is.
class BodyWay {
public:
    explicit BodyWay(const BodyMotion& motion);

    /// All numbers finite, rotations that are some.
    [[nodiscard]] bool valid() const { return valid_; }
    [[nodiscard]] BodyMoment at(double t) const;
    [[nodiscard]] Quatd rotationAt(double t) const;
    /// No length is stretched by more at a moment.
    [[nodiscard]] double stretchAt(double t) const { return (scale0_ + t * scale_).cwiseAbs().maxCoeff(); }
    /// Of a similarity, with a sign.
    [[nodiscard]] double scaleAt(double t) const { return scale0_.x() + t * scale_.x(); }

    /// Of x'' for points within `reach` of the origin, over the whole way: |R''| = ω², |R'| = ω, S'' = T'' = 0. It is
    /// square to the axis at any moment, for both of its parts are.
    [[nodiscard]] double acceleration(double reach) const {
        return (angle_ * angle_ * stretch_ + 2 * angle_ * swelling_) * reach;
    }
    /// About which it turns, in the shared frame; of unit length.
    [[nodiscard]] const Vec3d& axis() const { return axis_; }
    /// No length is stretched by more over the whole way.
    [[nodiscard]] double stretch() const { return stretch_; }
    /// A bound of |S'|.
    [[nodiscard]] double swelling() const { return swelling_; }
    /// A bound of |(R S)'|.
    [[nodiscard]] double turn() const { return angle_ * stretch_ + swelling_; }
    /// The same scale along all axes, but for signs, at any moment.
    [[nodiscard]] bool similarity() const { return similarity_; }
    /// No coordinate of a point within `reach` of the origin is larger, over the whole way.
    [[nodiscard]] double extent(double reach) const;

private:
    Quatd start_;
    Vec3d axis_ = Vec3d::UnitX();
    double angle_ = 0;
    Mat3d r_, kr_, kkr_;  ///< R(0), [axis] R(0), [axis]² R(0): Rodrigues' formula
    Vec3d shift0_, shift_, scale0_, scale_;
    double stretch_ = 1, swelling_ = 0;
    bool valid_ = false, similarity_ = true;
};

}  // namespace tessera
