/// Discrete orientation polytopes: slabs along fixed directions.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "common/math/Types.h"

namespace tessera {

/// Which directions: those of the axes (6 with their opposites), these and the cube's corners (14), these and the
/// middles of its edges (18), or all (26).
enum class DirectionSet : std::uint8_t { k6, k14, k18, k26 };

inline constexpr std::size_t kMaxDirections = 13;

/// Directions without their opposites: 3, 7, 9, 13.
[[nodiscard]] constexpr std::size_t directionCount(DirectionSet set) {
    constexpr std::size_t counts[] = {3, 7, 9, kMaxDirections};
    return counts[static_cast<std::size_t>(set)];
}

/// Small integers, *not* of unit length: a projection is one or two additions, and realigned weights need no division.
/// x, y, z come first in every set; then the middles of edges (1,1,0) (1,-1,0) (1,0,1) (1,0,-1) (0,1,1) (0,1,-1); then
/// the corners (1,1,1) (1,1,-1) (1,-1,1) (1,-1,-1). So k6 and k18 are the beginnings of k26.
[[nodiscard]] std::span<const Vec3d> directions(DirectionSet set);

/// The largest angle from any direction to the nearest of the set, in radians.
[[nodiscard]] double coveringAngle(DirectionSet set);

/// x·d for each direction of a set; what is behind their count is 0.
using Projections = std::array<double, kMaxDirections>;

/// Each is right to 2^-51 (|x|+|y|+|z|).
[[nodiscard]] Projections project(DirectionSet set, const Vec3d& x);

/// All x with lower[i] ≤ x·d_i ≤ upper[i], in the frame of the model itself, not about a centre. Empty when default
/// constructed. A value.
///
/// Its half-planes are numbered: i < n is x·d_i ≤ upper[i]; n + i is its opposite, -x·d_i ≤ -lower[i] (n =
/// directionCount).
struct KDop {
    explicit KDop(DirectionSet set);
    [[nodiscard]] static KDop around(DirectionSet set, std::span<const Vec3d> points);

    DirectionSet set;
    Projections lower, upper;  ///< behind the count: 0

    [[nodiscard]] std::size_t count() const { return directionCount(set); }
    [[nodiscard]] bool empty() const { return !(lower[0] <= upper[0]); }
    void extend(const Vec3d& point);
    /// Of the same set.
    void extend(const KDop& other);
    /// Some slab parts them, or (false) none does: touching overlaps. Of the same set.
    [[nodiscard]] bool overlaps(const KDop& other) const;

    /// The right-hand side of a half-plane, 0 to 2n - 1.
    [[nodiscard]] double halfPlane(std::size_t plane) const {
        return plane < count() ? upper[plane] : -lower[plane - count()];
    }
    /// No point of it has a larger |x·d_i|.
    [[nodiscard]] double magnitude(std::size_t i) const { return std::max(std::abs(lower[i]), std::abs(upper[i])); }
};

}  // namespace tessera
