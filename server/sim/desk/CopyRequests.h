/// Copies of what stands below a node, until they are edits.
#pragma once

#include <deque>

#include "server/sim/desk/OpenEdits.h"

namespace tessera {

/// A small copy is made at once. The list of a large one is made beside the frames, of the scene as it is by then, one
/// at a time: who joins, and what else that thread does, comes in between. None is made while those that wait for
/// frames hold `DeskLimits::maxOpenBytes`. Frame thread only.
class CopyRequests {
public:
    CopyRequests(const DeskSurroundings& around, const DeskLimits& limits, OpenEdits& edits)
        : around_(around), limits_(limits), edits_(edits) {}

    [[nodiscard]] ServerActions ask(const Asker& asker, const CloneWish& wish, TimePoint now);
    [[nodiscard]] ServerActions copied(Preparation made, TimePoint now);
    /// Orders the next one, where there is room. Call when edits have been closed.
    void goOn();

private:
    const DeskSurroundings& around_;
    const DeskLimits& limits_;
    OpenEdits& edits_;
    std::deque<Preparation> waiting_;  ///< for the one that is made
    bool making_ = false;
};

}  // namespace tessera
