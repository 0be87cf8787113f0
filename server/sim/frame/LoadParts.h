/// Cuts what a file brings into lists that are small enough for a frame each.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/scene/Aspect.h"
#include "server/sim/commit/EditHistory.h"

namespace tessera {

struct LoadPartLimits {
    std::size_t changes = 8'192;
    std::size_t bytes = std::size_t{1} << 20;  ///< of values; what is named (arrays) is not counted
    std::size_t seen = 8'192;                  ///< nodes that a list brings into the scene
};

/// Lists, at least one, which, one after the other, make what `list` makes. The first ones create all objects, and
/// nobody sees them yet: nodes hang nowhere in the scene, motions stand still. The others place them in the scene
/// (AppearingOrder.h), and the last of these sets going what moves by itself: motions, animations, particle emitters
/// and, where several lists place something, free bodies, which have no mass before. Each list keeps the limits, but
/// for the last, which is as large as what was there before makes it, and for single values beyond them.
///
/// A list stays whole which keeps the limits, or which does more than to create placeholders from kFirstPlaceholder up
/// without a gap and to place each new node once, behind its siblings. Cost: proportional to the list; on any thread.
[[nodiscard]] std::vector<ChangeList> cutForFrames(ChangeList list, const LoadPartLimits& limits = {});

/// An object of the range that the list names in any way; none: it speaks of others only.
[[nodiscard]] std::optional<ObjectId> namedIn(const ChangeList& list, const IdRange& range);

}  // namespace tessera
