/// When do two parts first touch anew that touch, or nearly so, before they move?
#pragma once

#include "server/collision/response/PairImpact.h"
#include "server/collision/response/Rest.h"

namespace tessera {

/// Nearer than this part of the stop tolerance faces rest on each other, whether they touch or not.
inline constexpr double kTogether = 4e-6;

/// Adds pairs of faces, as everything is before it moves.
bool addRest(Rest& rest, const Part& a, const Affine3d& worldA, const Part& b, const Affine3d& worldB,
             std::span<const FacePair> faces, const RestTerms& terms);

/// The first contact of faces that are apart at the start and not flush with what the two rest on, or the time at which
/// what rests gets deeper (Impact::support >= 0). `rest`: of this pair; `shared`: supports of others that what moves
/// rests on. Faces that are found to be together at the start as near as rounding can tell, though they do not touch,
/// are added to the rest. Where nothing rests as `firstRigidContact`.
[[nodiscard]] Impact firstNewContact(const ObjectHandler& handler, std::uint32_t partA, std::uint32_t partB,
                                     const WayLookup& wayOf, double near, Rest& rest, std::span<const Support> shared,
                                     const RestTerms& terms, QueryWork& work);

/// Adds those of `more` that are not there yet, up to kMostSupports. `reversed`: seen from the other body.
void shareSupports(std::vector<Support>& supports, std::span<const Support> more, bool reversed, double tolerance);

}  // namespace tessera
