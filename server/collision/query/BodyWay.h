/// Where the points of a body on its way are at a moment, how fast they go, and how much that can change.
#pragma once

#include <vector>

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

/// x(t) = T(t) + R(t)·S(t)·M·x; T and S linear, R(t) = exp(t [ω]) R(0) with a constant ω, as a slerp is; M, the body's
/// own map of its mesh, does not change. Or a product of such maps, where others carry it.
class BodyWay {
public:
    explicit BodyWay(const BodyMotion& motion);

    /// All numbers finite, rotations that are some.
    [[nodiscard]] bool valid() const { return valid_; }
    [[nodiscard]] BodyMoment at(double t) const;
    /// Not counting what carries it.
    [[nodiscard]] Quatd rotationAt(double t) const;
    [[nodiscard]] bool carried() const { return !carriers_.empty(); }
    /// No length is stretched by more at a moment.
    [[nodiscard]] double stretchAt(double t) const {
        double stretch = (scale0_ + t * scale_).cwiseAbs().maxCoeff() * innerStretch_;
        for (const BodyWay& carrier : carriers_) stretch *= carrier.stretchAt(t);
        return stretch;
    }
    /// By how much that can exceed the line between its ends: where of the maps one grows as another shrinks.
    [[nodiscard]] double stretchAboveChord() const;
    /// Of a similarity, with a sign.
    [[nodiscard]] double scaleAt(double t) const {
        double scale = (scale0_.x() + t * scale_.x()) * innerScale_;
        for (const BodyWay& carrier : carriers_) scale *= carrier.scaleAt(t);
        return scale;
    }

    /// How far from the body's origin M puts a point, and all points within `radius` of one.
    [[nodiscard]] double reachOf(const Vec3d& x) const {
        return inner_ ? (innerLinear_ * x + innerShift_).norm() : x.norm();
    }
    [[nodiscard]] double reachAround(const Vec3d& x, double radius) const {
        return reachOf(x) + innerStretch_ * radius;
    }

    /// Of x'' for points within `reach` of the body's origin, over the whole way.
    [[nodiscard]] double acceleration(double reach) const {
        return carried() ? bend_.of(reach) : (angle_ * angle_ * stretch_ + 2 * angle_ * swelling_) * reach;
    }
    /// Of n · x'' for a unit n: |R''| = ω², |R'| = ω, S'' = T'' = 0, so that x'' is square to the axis at any moment;
    /// of what is carried nothing is known of its direction.
    [[nodiscard]] double accelerationAlong(const Vec3d& n, double reach) const {
        return acceleration(reach) * (carried() ? 1 : n.cross(axis_).norm() + 1e-15);
    }
    /// About which it turns, in the shared frame; of unit length. Of what is not carried.
    [[nodiscard]] const Vec3d& axis() const { return axis_; }
    /// How fast points within `reach` of the body's origin can go along a unit direction, at most; against it less than
    /// 0 where all go away.
    [[nodiscard]] double advance(const Vec3d& n, double reach) const {
        return carried() ? speed_.of(reach)
                         : n.dot(shift_) + (angle_ * stretch_ * n.cross(axis_).norm() + swelling_) * reach;
    }
    /// A direction that turns with the body, of unit length: where it is, how it changes, and `turn`, a bound of its
    /// rate whose square bounds the second derivative.
    struct Turned {
        Vec3d direction, rate;
        double turn;
    };
    [[nodiscard]] Turned turned(const Vec3d& atStart, double t) const;
    /// Whether it does: all that carries it scales evenly, and nothing turns inside out.
    [[nodiscard]] bool turnsDirections() const { return !carried() || turnsDirections_; }
    /// Translation alone.
    [[nodiscard]] bool straight() const { return angle_ == 0 && swelling_ == 0 && !carried(); }
    /// No length is stretched by more over the whole way.
    [[nodiscard]] double stretch() const { return wholeStretch_; }
    /// A bound of the rate of `stretchAt`.
    [[nodiscard]] double swelling() const { return wholeSwelling_; }
    /// A bound of the rate of the linear map.
    [[nodiscard]] double turn() const { return wholeTurn_; }
    /// The same scale along all axes, but for signs, at any moment.
    [[nodiscard]] bool similarity() const { return similarity_; }
    /// No number that arises from a point within `reach` of the mesh's origin is larger, over the whole way; counted
    /// once more for each that carries it.
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

    /// With all that carries it.
    double wholeStretch_ = 1, wholeSwelling_ = 0, wholeTurn_ = 0;

    /// A bound for points within some reach, of what is carried.
    struct Bound {
        double fixed = 0, perReach = 0;
        [[nodiscard]] double of(double reach) const { return fixed + perReach * reach; }
        friend Bound operator+(const Bound& a, const Bound& b) { return {a.fixed + b.fixed, a.perReach + b.perReach}; }
        friend Bound operator*(double factor, const Bound& a) { return {factor * a.fixed, factor * a.perReach}; }
    };
    void addCarriers();
    [[nodiscard]] bool keepsSides() const { return similarity_ && scale0_.x() * (scale0_ + scale_).x() > 0; }
    Bound speed_, bend_;
    bool turnsDirections_ = false;
    std::vector<BodyWay> carriers_;  ///< from the shared frame down
};

}  // namespace tessera
