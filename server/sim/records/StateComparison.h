/// Finds the first object in which a replica differs from the scene.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/scene/Aspect.h"
#include "common/session/Messages.h"

namespace tessera {

/// One walk down the hash tree of one replica, which stands still: first its leaves, then the objects of the first leaf
/// that differs. It holds the hashes of that one leaf in between, whatever the size of the scene. Each step costs what
/// the replica has said, the first one also a look at each leaf of the scene. Not thread-safe.
class StateComparison {
public:
    struct Step {
        std::optional<std::uint64_t> queryLeaf = {};  ///< ask for this leaf's objects next; none: done
        std::string finding = {};  ///< of the end: the first differing object, or why none is named, in words
        bool named = false;        ///< an object is
    };
    /// `scene`: as it was at the list at which the replica stands. `theirs`: its leaves.
    [[nodiscard]] Step leaves(const Aspect& scene, std::span<const HashEntry> theirs);
    /// `theirs`: its objects of that leaf; others do not count. `scene`: for names only, so it may have gone on.
    [[nodiscard]] Step objects(const Aspect& scene, std::span<const HashEntry> theirs) const;

private:
    std::uint64_t leaf_ = 0;
    std::vector<HashEntry> ours_;  ///< of that leaf, ascending
};

}  // namespace tessera
