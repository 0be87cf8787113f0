/// Triangles against triangles: the entry that every other may fall back to.
#pragma once

#include "server/collision/pairwise/PairTable.h"

namespace tessera::surface_pairs {

[[nodiscard]] PairTouch touch(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b,
                              const PairEffort& effort);
[[nodiscard]] PairTouch contacts(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b,
                                 std::size_t most, const PairEffort& effort);
[[nodiscard]] Distance distance(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b,
                                QueryWork& work, const DistanceOptions& options);
[[nodiscard]] Impact firstContact(const CollisionShape& a, const BodyMotion& motionA, const CollisionShape& b,
                                  const BodyMotion& motionB, QueryWork& work, const ImpactOptions& options);
[[nodiscard]] PairDepth depth(const PlacedShape& a, const PlacedShape& b, QueryWork& work);

}  // namespace tessera::surface_pairs
