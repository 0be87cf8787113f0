/// Quick rejection between two bodies bounded by spherical Bernstein-Bézier patches.
#pragma once

#include <cstdint>
#include <vector>

#include "common/math/Types.h"
#include "server/collision/mesh/QueryWork.h"
#include "server/collision/spherical_bezier/SphericalBezierBound.h"

namespace tessera {

struct PatchPair {
    std::uint32_t a = 0, b = 0;
};

/// The pairs of patches within whose cones the two bodies may meet; every pair of faces that meets has such a point in
/// one of them. Ascending. Of a map that is no similarity (rotation, mirroring, one scale) every pair of patches that
/// are not empty.
///
/// What A has in a patch lies in a ball, and B's in another one. The ball, seen from B's centre, is within a cone of
/// directions and nowhere nearer than D - s: where p, there, is less than that in a patch of B, the pair is out; and
/// the same with A and B exchanged.
[[nodiscard]] std::vector<PatchPair> patchesThatMayMeet(const SphericalBezierBound& a, const SphericalBezierBound& b,
                                                        const Affine3d& a_T_b, QueryWork& work);

/// Whether the body may meet a ball, in its frame, by any of its patches: no is certain. Looks at each of them.
[[nodiscard]] bool mayMeetBall(const SphericalBezierBound& body, const Vec3d& centre, double radius, QueryWork& work);

}  // namespace tessera
