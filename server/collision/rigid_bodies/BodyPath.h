/// Where a body goes within a frame: its centre straight, turning about one axis through it.
#pragma once

#include "common/math/Types.h"

namespace tessera::rigid {

/// t from 0 to 1. Rotations between are slerp's, without a sine: halved by normalised sums, which is exact, until the
/// straight line between two quaternions is as good as the arc.
struct BodyPath {
    Vec3d centre = Vec3d::Zero(), moved = Vec3d::Zero();
    Quatd turned = Quatd::Identity();  ///< w ≥ 0
    double rate = 0;                   ///< radians per whole way, at most

    BodyPath() = default;
    BodyPath(const Vec3d& centre, const Vec3d& moved, const Quatd& turned);

    [[nodiscard]] bool still() const { return rate == 0 && moved.isZero(0); }
    [[nodiscard]] Quatd turnAt(double t) const;
    /// From where things are as the frame begins to where they are then.
    [[nodiscard]] Isometry3d at(double t) const;
    /// By how much a point so far from the centre leaves the chord between two of its places, at most.
    [[nodiscard]] double arc(double radius, double part) const {
        const double angle = rate * part;
        return 0.125 * radius * angle * angle * (1 + angle);
    }
    /// No point so far from the centre is farther from where it is on the other way at the same time, from the same
    /// centre. Infinite where either turns by more than half a radian.
    [[nodiscard]] double strayedFrom(const BodyPath& other, double radius) const;
    /// The first part of it.
    void cut(double t);

private:
    Quatd half_ = Quatd::Identity(), quarter_ = half_, eighth_ = half_;
    bool fine_ = true;  ///< small enough for one straight line
};

/// A rotation by spin · seconds, without a library's sine, whose last digit depends on the processor.
[[nodiscard]] Quatd turnBy(const Vec3d& spin, double seconds);

}  // namespace tessera::rigid
