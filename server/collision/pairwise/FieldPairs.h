/// Height fields: with triangles, with hulls by their faces, with each other. The answers of the same triangles.
#pragma once

#include "server/collision/pairwise/PairTable.h"

namespace tessera::field_pairs {

/// One of the two is a height field, or both are; the other is taken by its triangles.
[[nodiscard]] PairTouch touch(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b,
                              const PairEffort& effort);
[[nodiscard]] PairTouch contacts(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b,
                                 std::size_t most, const PairEffort& effort);
[[nodiscard]] Distance distance(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b,
                                QueryWork& work, const DistanceOptions& options);
[[nodiscard]] Impact firstContact(const CollisionShape& a, const BodyMotion& motionA, const CollisionShape& b,
                                  const BodyMotion& motionB, QueryWork& work, const ImpactOptions& options);
/// A field encloses nothing: 0 where they are apart, else nothing.
[[nodiscard]] PairDepth depth(const PlacedShape& a, const PlacedShape& b, QueryWork& work);

}  // namespace tessera::field_pairs
