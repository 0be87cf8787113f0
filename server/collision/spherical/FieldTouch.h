/// Which triangles of two bodies meet, found by looking one of them up in the other's spherical field.
///
/// The answers are those of ../query/TouchQuery.h: the same predicate decides about the same triangles. `a_T_b` may be
/// any finite affine map; where it cannot be turned round, or hardly, or where the walked tree is not one of oriented
/// boxes, the trees are asked instead.
#pragma once

#include "server/collision/query/TouchQuery.h"
#include "server/collision/spherical/SphericalField.h"

namespace tessera {

/// The body of smaller triangles is walked, the other one's field is looked up in. kYes names one pair that meets.
[[nodiscard]] TouchedPair firstTouching(const SphericalField& a, const SphericalField& b, const Affine3d& a_T_b,
                                        QueryWork& work, const TouchOptions& options = {});
[[nodiscard]] FacePairs allTouching(const SphericalField& a, const SphericalField& b, const Affine3d& a_T_b,
                                    QueryWork& work, const TouchOptions& options = {});

/// A body that has no field is walked.
[[nodiscard]] TouchedPair firstTouching(const SphericalField& a, const TriangleTree& b, const Affine3d& a_T_b,
                                        QueryWork& work, const TouchOptions& options = {});
[[nodiscard]] FacePairs allTouching(const SphericalField& a, const TriangleTree& b, const Affine3d& a_T_b,
                                    QueryWork& work, const TouchOptions& options = {});
[[nodiscard]] TouchedPair firstTouching(const TriangleTree& a, const SphericalField& b, const Affine3d& a_T_b,
                                        QueryWork& work, const TouchOptions& options = {});
[[nodiscard]] FacePairs allTouching(const TriangleTree& a, const SphericalField& b, const Affine3d& a_T_b,
                                    QueryWork& work, const TouchOptions& options = {});

}  // namespace tessera
