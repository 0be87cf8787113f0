/// Copies of much of a scene: made beside the frames, and brought part by part.
#pragma once

#include <cstdint>
#include <vector>

#include "common/scene/Clones.h"
#include "server/sim/frame/LoadParts.h"

namespace tessera {

struct CopyOrder {
    std::uint64_t ticket = 0;
    ObjectId node;
    CloneOptions options;
};

struct CopyMade {
    std::uint64_t ticket = 0;
    Expected<ObjectId> node;   ///< the placeholder of the node's copy
    LoadParts parts;           ///< of cloneList's list
    std::vector<Blob> named;   ///< by all of them
    std::uint64_t bytes = 0;   ///< of memory that the parts take; arrays are the scene's
};

/// On any thread. A copy stays whole where others' edits may make it senseless before its last part is there: one that brings
/// films (of which each image has one).
[[nodiscard]] CopyMade makeCopy(const Aspect& scene, const CopyOrder& order);

}  // namespace tessera
