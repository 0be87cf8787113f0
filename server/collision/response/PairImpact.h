/// When do two parts first touch, while everything that moves is on its way?
#pragma once

#include <span>

#include "server/collision/query/TimeOfImpact.h"
#include "server/collision/response/Way.h"

namespace tessera {

/// The first contact of two parts within a frame's motion: every transform goes its whole way (or stands still where
/// `wayOf` knows none) as the same fraction of the frame passes, whatever stands above whom; a part that the handler
/// says deforms goes with its vertices. As `timeOfImpact`: never late, the faces named are within the tolerance (world
/// units) at t, hull shapes by their surfaces. `normal`, `point` and `distance` (of the faces named) in the world.
///
/// What deforms below transforms that turn or scale, and what deforms beside balls, is advanced by its distance over a
/// bound of its speed: so is what begins within the tolerance and parts (a hit at 0 then), and after kMostAdvances
/// steps the answer is `complete` = false at a t that is known to be free.
[[nodiscard]] Impact firstContact(const ObjectHandler& handler, std::uint32_t partA, std::uint32_t partB,
                                  const WayLookup& wayOf, double tolerance, QueryWork& work);

/// The same of the shapes as they are: nothing deforms.
[[nodiscard]] Impact firstRigidContact(const ObjectHandler& handler, std::uint32_t partA, std::uint32_t partB,
                                       const WayLookup& wayOf, double tolerance, QueryWork& work);

/// The same of parts that smooth surfaces answer for (FreeformPairs.h), as these; the faces are those drawn where they
/// meet. What begins within the tolerance is a hit at 0.
[[nodiscard]] Impact firstSmoothContact(const ObjectHandler& handler, std::uint32_t partA, std::uint32_t partB,
                                        const WayLookup& wayOf, double tolerance, QueryWork& work);

/// The same of parts that rest on each other or are stuck in each other: `supports` (see Support; lengths and normals
/// of the world as everything is at the start) hold what would touch, `within` is left out.
[[nodiscard]] Impact firstContactBeside(const ObjectHandler& handler, std::uint32_t partA, std::uint32_t partB,
                                        const WayLookup& wayOf, double tolerance, std::span<const Support> supports,
                                        std::span<const FacePair> within, QueryWork& work);

inline constexpr int kMostAdvances = 400;

}  // namespace tessera
