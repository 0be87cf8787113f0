/// When does each pair of a rollback first touch anew?
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "server/collision/response/RestingImpact.h"

namespace tessera {

struct RollbackPair {
    std::uint32_t state = 0;  ///< the caller's
    std::uint32_t partA = 0, partB = 0;
    bool touching = false;  ///< before anything moves
};

struct RollbackContact {
    RollbackPair pair;
    Impact impact;
};

/// Everything being on its way. Where pairs touch already: faces that were apart and are not flush with what any of
/// these pairs rests on, or what gets deeper. Hulls wholly within each other are left out: a stop's rules are for
/// those.
[[nodiscard]] std::vector<RollbackContact> firstRollbackContacts(const ObjectHandler& handler,
                                                                 std::span<const RollbackPair> pairs,
                                                                 const WayLookup& wayOf, double stopTolerance,
                                                                 QueryWork& work);

}  // namespace tessera
