/// GJK in exact arithmetic: slow, and right.
#pragma once

#include <span>
#include <vector>

#include "common/math/Types.h"
#include "server/collision/convex/ConvexQuery.h"

namespace tessera {

struct ExactDescent {
    bool apart = false;
    /// Not settled in kMaxExactSteps.
    bool gaveUp = false;
    /// The simplex at the end, affinely independent. Touching: the origin is in it, and is the sum of its points
    /// times these weights. Apart, and the nearest was asked for: the nearest point is in it.
    std::vector<VertexPair> simplex;
    std::vector<double> weights;
    std::uint64_t supports = 0;
};

inline constexpr int kMaxExactSteps = 2'000;

/// Are the hulls of two sets of points (in one frame, neither empty) apart? Hints: pairs likely to be in the simplex,
/// the first of them where to begin. With `nearest` it goes on until the simplex is the one nearest to the origin.
///
/// Each step lowers the distance of the simplex from the origin, strictly, and there are finitely many simplices, so it
/// ends whatever the points are: in one plane, on one line, equal. The nearest part of a simplex is found by Johnson's
/// sub-algorithm (Gilbert, Johnson and Keerthi 1988), which in exact arithmetic has none of its troubles. Any finite
/// coordinates will do: where products of sums of doubles would underflow, whole numbers of any length are taken.
[[nodiscard]] ExactDescent descendExactly(std::span<const Vec3d> a, std::span<const Vec3d> b,
                                          std::span<const VertexPair> hints, bool nearest);

}  // namespace tessera
