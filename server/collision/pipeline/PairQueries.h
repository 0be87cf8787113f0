/// The pairwise stage: the queries that one pair of parts is asked, whatever their shapes.
#pragma once

#include "server/collision/pipeline/PairMemory.h"
#include "server/collision/pipeline/StepResult.h"

namespace tessera {

/// Brings the answer up to date where it does not hold for the parts as they are. `all`: every pair of faces (the first
/// `most` are kept), else one. Solids count as full: a hull touches what is inside it.
void askTouch(PairState& state, const Part& a, const Part& b, bool all, std::size_t most, QueryWork& work);

/// The same for the distance, up to `upperBound` (world units): 0 where they touch.
void askDistance(PairState& state, const Part& a, const Part& b, double upperBound, QueryWork& work);

/// Where two faces meet, given the poses in which they do (PairContact.h). Not filled in: objects, interest and time.
[[nodiscard]] Contact contactOfFaces(const Part& a, const Part& b, const Affine3d& worldA, const Affine3d& worldB,
                                     const FacePair& faces);
/// The same where the place is known better than by the faces that it is on.
[[nodiscard]] Contact contactOfPlace(const Part& a, const Part& b, const Affine3d& worldA, const Affine3d& worldB,
                                     const FacePair& faces, const MeetingPlace& place);
/// Where two hulls meet: the middle between the deepest points.
[[nodiscard]] Contact contactOfHulls(const Part& a, const Part& b, const Affine3d& worldA, const Affine3d& worldB);

}  // namespace tessera
