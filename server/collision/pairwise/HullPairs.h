/// Hulls, which are solid: against each other by their supports, against surfaces by their faces and their insides.
#pragma once

#include "server/collision/pairwise/PairTable.h"

namespace tessera::hull_pairs {

[[nodiscard]] PairTouch touch(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b,
                              const PairEffort& effort);
[[nodiscard]] PairTouch contacts(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b,
                                 std::size_t most, const PairEffort& effort);
/// The faces named are none (kWhole).
[[nodiscard]] Distance distance(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b,
                                QueryWork& work, const DistanceOptions& options);
[[nodiscard]] PairDepth depth(const PlacedShape& a, const PlacedShape& b, QueryWork& work);

/// One of the two is a hull, the other a surface; in either order.
[[nodiscard]] PairTouch touchSurface(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b,
                                     const PairEffort& effort);
[[nodiscard]] PairTouch contactsWithSurface(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b,
                                            std::size_t most, const PairEffort& effort);
[[nodiscard]] Distance distanceToSurface(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b,
                                         QueryWork& work, const DistanceOptions& options);

}  // namespace tessera::hull_pairs
