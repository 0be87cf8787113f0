/// k-DOPs under an affine map: bounds along a frame's directions for what is a k-DOP in another frame.
///
/// For y = M x + T and a direction d of the target frame, y·d = x·p + T·d with p = Mᵀd. Whenever p = Σ λ_i d_i with
/// λ ≥ 0 over half-planes x·d_i ≤ h_i of the source, x·p ≤ Σ λ_i h_i: a few multiply-adds per volume, never too small
/// (Zachmann, VRAIS 1998; weak duality of linear programming). p is not normalised, so every finite M will do:
/// non-uniform scale, mirroring, flattening.
///
/// The three half-planes are those that meet in the vertex of the DOP around the unit sphere that is farthest along p;
/// among all λ they make Σ λ_i |d_i| least, so they are best for round things. For the sets here these are found
/// by ordering |p_x|, |p_y|, |p_z|, and the weights are sums and differences of these, not negative by the order:
/// with a ≥ b ≥ c their sizes and A, B, C the signed axes,
///
///     k6   a·A + b·B + c·C
///     k14  (a-b)·A + (b+c)/2·(A+B+C) + (b-c)/2·(A+B-C)
///     k18  (a-b-c)·A + b·(A+B) + c·(A+C)                                    where a ≥ b + c, else
///          (a+b-c)/2·(A+B) + (a+c-b)/2·(A+C) + (b+c-a)/2·(B+C)
///     k26  (a-b)·A + (b-c)·(A+B) + c·(A+B+C)
///
/// Because every set contains the opposites of its directions, -p has the opposite half-planes with the same weights.
///
/// With k18 and k26 the bound is never looser than that of the axis box (replace h of A+B by hA + hB); with k14 it can
/// be, by (b-c)/2 times the box's width along C.
#pragma once

#include <array>
#include <cstdint>

#include "server/collision/volume/KDop.h"

namespace tessera {

/// How a k-DOP is bounded along foreign directions without looking at what is inside.
enum class PlaneChoice : std::uint8_t {
    kThreePlanes,
    kBoxEnclosure,  ///< the axis box turned (Arvo): three weights on axis planes; the baseline
};

struct WeightedPlanes {
    std::array<std::uint8_t, 3> plane;  ///< half-planes of the source (KDop), in no order
    std::array<double, 3> weight;       ///< ≥ 0; Σ weight · direction is p, up to rounding
};

/// Everything that one pair of frames needs, found once per query. A value; finite if the map is.
struct PlaneWeights {
    /// From B's frame to A's. `source` are the directions of B's volumes, `target` those of A's.
    [[nodiscard]] static PlaneWeights make(DirectionSet source, DirectionSet target, const Affine3d& a_T_b,
                                           PlaneChoice choice = PlaneChoice::kThreePlanes);

    DirectionSet source, target;
    /// Per target direction; its opposite has the opposite half-planes, the same weights and minus the offset.
    std::array<WeightedPlanes, kMaxDirections> planes;
    std::array<double, kMaxDirections> offset;  ///< T·d

    /// For what lies in `whole` (of the source), more than rounding in double can do to any bound: that of weights
    /// and sums here, of `project` on either side, and of mapping the points themselves, a_T_b * x.
    [[nodiscard]] double rounding(const KDop& whole) const;

    Affine3d map;
};

/// For kernels, which keep the 2n right-hand sides h of a volume in float, lower[i] as h[n + i] = -lower[i]:
///
///     h'[i] = weight[i][0]·h[plane[i][0]] + weight[i][1]·h[plane[i][1]] + weight[i][2]·h[plane[i][2]] + offset[i]
///
/// for all 2n target half-planes. Plain data.
struct FloatPlaneWeights {
    std::uint8_t plane[2 * kMaxDirections][3];
    float weight[2 * kMaxDirections][3];
    float offset[2 * kMaxDirections];  ///< ±T·d plus the slack
};

/// With the slack that makes the line above an upper bound in float, in any order of sums, with fused multiply-adds or
/// without, also where numbers too small for float become 0: every h of a volume within `whole` is taken to be rounded
/// to float upwards, and `whole` to hold the floats. With ε = 2^-24 and R_i = whole.magnitude(i),
///
///     slack = 7 ε (Σ weight_i R_i + |T·d|) + rounding + 2^-120 (1 + Σ R_x,y,z)
///
/// (four roundings of a sum of four terms, of which three are products: γ4 = 4ε / (1 - 4ε); one more for the weights,
/// one for the offset). Where a float overflows, h' is infinite or NaN: a kernel must take NaN for "may overlap".
[[nodiscard]] FloatPlaneWeights forKernels(const PlaneWeights& weights, const KDop& whole);

}  // namespace tessera
