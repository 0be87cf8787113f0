/// Smooth surfaces as they are (../freeform): against each other, triangles, hulls, and whatever is of triangles.
#pragma once

#include <optional>

#include "server/collision/pairwise/PairTable.h"

namespace tessera::freeform_pairs {

/// In A's frame: what is told to touch is no farther apart, and distances are no more wrong, but where their share of
/// the work ends (500,000 tests of parts a question): then they say a larger error. Of two smooth surfaces the smaller
/// tolerance counts.
[[nodiscard]] double toleranceOf(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b);

/// Where on a smooth surface its nearest point to a place is, in its frame; of other shapes kWhole.
[[nodiscard]] PatchPlace patchAt(const CollisionShape& shape, const Vec3d& point);

// One of the two is a smooth surface, or both are. What meets is never told apart; between that and the tolerance
// either may be told. The faces that are named are those of the triangles that are drawn, each the nearest one to its
// place; a hull is solid.

TouchMethod touch;
/// Places where they meet, a 64th of the smaller one apart; of those that fall on the same two faces one.
ContactsMethod contacts;
/// 0 where they are told to touch, and nowhere else. No faces are named (kWhole).
DistanceMethod distance;
/// Never late, and within the options' tolerance of touching. With supports, faces left out or a margin by the
/// triangles.
FirstContactMethod firstContact;
/// The way along `normal` after which B is apart for good; the normal is that of the deepest region of the triangles,
/// or, where these have none, the contacts'. `error`: so much less far they still meet. Nothing where what is drawn
/// encloses nothing.
DepthMethod depth;

// What motions ask of two in the world. They keep what is apart apart, by more than the tolerance could tell.

/// Whether smooth surfaces are what answers for the two.
[[nodiscard]] bool answersFor(const CollisionShape& a, const CollisionShape& b);
/// Proven: no points of the two are nearer. At most `most`; 0 where they meet, are told to by rounding alone, or it is
/// not known.
[[nodiscard]] double provenGap(const PlacedShape& a, const PlacedShape& b, double most, QueryWork& work);
/// Do they meet? kNo is proven; kYes is right to rounding.
[[nodiscard]] Touch meeting(const PlacedShape& a, const PlacedShape& b, QueryWork& work);

struct NearestPlaces {
    MeetingPlace place;  ///< between them; the normal is the way from A to B, or, where that is nothing or not unique,
                         ///< what the surfaces say
    double distance = 0;
    FacePair faces;  ///< the triangles that are drawn there
};
/// Nothing where they meet inside a hull, are empty, or it is not known. (Where no frame is a similarity: near ones,
/// not the nearest.)
[[nodiscard]] std::optional<NearestPlaces> nearestPlaces(const PlacedShape& a, const PlacedShape& b, QueryWork& work);

}  // namespace tessera::freeform_pairs
