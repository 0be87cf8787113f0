/// Lists that wait for a reader become fewer: each change is merged a few times at most, however many lists there are.
#pragma once

#include <array>
#include <memory>
#include <utility>
#include <vector>

#include "common/change/ChangeList.h"

namespace tessera {

/// While the newest two are of like size: they become one of like effect. `Waiting` has `list`, a ChangeListPtr that is
/// not null; `joined(older, newer, list)` makes one of two. No list gets more than `mostChanges` so. Two stay apart
/// where an id that was destroyed comes back: one list could not say both.
template <typename Waiting, typename Joined>
void mergeLikeSizes(std::vector<Waiting>& waiting, std::size_t mostChanges, Joined&& joined) {
    while (waiting.size() > 1) {
        const Waiting& older = waiting[waiting.size() - 2];
        const Waiting& newer = waiting.back();
        const std::size_t before = older.list->changeCount(), after = newer.list->changeCount();
        if (before > 2 * after || before + after > mostChanges) return;
        std::vector<ChangeList> merged = compact(std::array{older.list, newer.list});
        if (merged.size() > 1) return;
        Waiting both =
            joined(older, newer,
                   std::make_shared<const ChangeList>(merged.empty() ? ChangeList() : std::move(merged.front())));
        waiting.pop_back();
        waiting.back() = std::move(both);
    }
}

}  // namespace tessera
