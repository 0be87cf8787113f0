/// Which placements bring children of a node into the order that a file has.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "common/change/ChangeList.h"
#include "common/cores/ChildList.h"

namespace tessera {

struct OrderedChild {
    /// Of one that the former file had: its place among its siblings there.
    static constexpr std::int64_t kNew = -1;    ///< it hangs nowhere yet
    static constexpr std::int64_t kStays = -2;  ///< it is not to be moved

    ObjectId id;
    std::int64_t was = kNew;
};

/// To be made one after the other, once what `goes` has been detached. `now`: the children that the node has; `wanted`:
/// those of the file, in its order; of them what hangs elsewhere stays there. As few move as the file has moved, and
/// others' children stay where they are: each that moves or is new comes right behind the one before it in the file.
[[nodiscard]] std::vector<Placement> childOrder(const ChildList& now, std::span<const OrderedChild> wanted,
                                                ObjectId parent, const std::function<bool(ObjectId)>& goes);

}  // namespace tessera
