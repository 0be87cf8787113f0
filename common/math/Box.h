/// Axis-aligned boxes and spheres.
#pragma once

#include <limits>

#include "common/math/Types.h"

namespace tessera {

/// Axis-aligned box in double; empty when default constructed. Touching counts as overlapping.
struct Box {
    Vec3d lower = Vec3d::Constant(std::numeric_limits<double>::infinity());
    Vec3d upper = Vec3d::Constant(-std::numeric_limits<double>::infinity());

    [[nodiscard]] bool empty() const { return !(lower.array() <= upper.array()).all(); }
    [[nodiscard]] Vec3d center() const { return 0.5 * (lower + upper); }
    [[nodiscard]] Vec3d size() const { return upper - lower; }
    void extend(const Vec3d& p) {
        lower = lower.cwiseMin(p);
        upper = upper.cwiseMax(p);
    }
    void extend(const Box& b) {
        lower = lower.cwiseMin(b.lower);
        upper = upper.cwiseMax(b.upper);
    }
    [[nodiscard]] bool overlaps(const Box& b) const {
        return (lower.array() <= b.upper.array()).all() && (b.lower.array() <= upper.array()).all();
    }
    [[nodiscard]] bool contains(const Vec3d& p) const {
        return (lower.array() <= p.array()).all() && (p.array() <= upper.array()).all();
    }
    /// The box around this box seen in another frame (Arvo, Graphics Gems I).
    [[nodiscard]] Box transformed(const Affine3d& m) const;
};

}  // namespace tessera
