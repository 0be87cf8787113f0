/// Smooth surfaces as they are (../freeform): against each other, triangles, hulls, and whatever is of triangles.
#pragma once

#include "server/collision/pairwise/PairTable.h"

namespace tessera::freeform_pairs {

/// In A's frame: what is told to touch is no farther apart, and distances are no more wrong, but where their share of the work ends (500,000
/// tests of parts a question): then they say a larger error. Of two smooth surfaces the smaller tolerance counts.
[[nodiscard]] double toleranceOf(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b);

// One of the two is a smooth surface, or both are. What meets is never told apart; between that and the tolerance either may be told. The
// faces that are named are those of the triangles that are drawn, each the nearest one to its place; a hull is solid.

TouchMethod touch;
/// Places where they meet, a 64th of the smaller one apart; of those that fall on the same two faces one.
ContactsMethod contacts;
/// 0 where they are told to touch, and nowhere else. No faces are named (kWhole).
DistanceMethod distance;
/// Never late, and within the options' tolerance of touching. With supports, faces left out or a margin by the triangles.
FirstContactMethod firstContact;
/// The way along `normal` after which B is apart for good; the normal is that of the deepest region of the triangles, or, where these have
/// none, the contacts'. `error`: so much less far they still meet. Nothing where what is drawn encloses nothing.
DepthMethod depth;

}  // namespace tessera::freeform_pairs
