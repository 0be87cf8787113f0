/// Lists that wait for a thread that is behind.
#pragma once

#include <vector>

#include "server/sim/commit/Committer.h"

namespace tessera {

/// As they came, or merged: each becomes one with those before it of like size and like effect, up to 32,768 changes,
/// so that what waits is in proportion to what the lists set and not to their number. What that costs is spread over
/// the lists: each change is merged a few times. Placements, and what brings back an id that was destroyed, stay as
/// they came. Not thread-safe.
class WaitingLists {
public:
    struct Waiting {
        Sequence sequence;  ///< of the last one that is in it
        ChangeListPtr list;
        std::size_t bytes = 0;
    };
    enum class Merge : bool { kNo, kYes };
    /// Its list is not null.
    void add(const CommittedFrame& frame, Merge merge);

    [[nodiscard]] const std::vector<Waiting>& lists() const { return lists_; }
    /// Of memory, arrays included.
    [[nodiscard]] std::size_t bytes() const { return bytes_; }

private:
    void mergeNewest();

    std::vector<Waiting> lists_;
    std::size_t bytes_ = 0;
};

}  // namespace tessera
