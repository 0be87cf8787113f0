/// What Eigen has to iterate for. Compiled once: each of these costs a file that includes it seconds.
#pragma once

#include "common/math/Types.h"

namespace tessera {

/// matrix = u · diagonal(values) · vᵀ; the values are not negative, the largest first. u and v are orthogonal, and may
/// mirror.
struct SingularValues {
    Mat3d u, v;
    Vec3d values;
};
[[nodiscard]] SingularValues singularValuesOf(const Mat3d& matrix);
/// How long a vector of length 1 becomes, at most and at least.
struct SingularStretch {
    double most = 0, least = 0;
};
[[nodiscard]] SingularStretch singularStretchOf(const Mat3d& matrix);
/// A bound of the former, quickly: the root of the largest row sum of mᵀm, which bounds its largest eigenvalue. Exact,
/// but for a margin of rounding, for rotations and even scales.
[[nodiscard]] double stretchOf(const Mat3d& matrix);

/// The rotation nearest to a transform's linear part.
[[nodiscard]] Mat3d rotationOf(const Affine3d& transform);
/// The smallest turn that leads one direction to another; neither need have length 1.
[[nodiscard]] Quatd turnBetween(const Vec3d& from, const Vec3d& to);

}  // namespace tessera
