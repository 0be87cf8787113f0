#include "server/sim/reload/ChildOrder.h"

#include <algorithm>
#include <unordered_map>
#include <unordered_set>

namespace tessera {
namespace {

/// Of numbers, all different, those of a longest increasing run: as flags.
std::vector<bool> longestIncreasing(const std::vector<std::int64_t>& numbers) {
    constexpr std::size_t kNone = ~std::size_t{0};
    std::vector<std::size_t> ends, before(numbers.size(), kNone);  // `ends[k]`: where the best run of k + 1 ends
    for (std::size_t i = 0; i < numbers.size(); ++i) {
        const auto at = std::ranges::lower_bound(ends, numbers[i], {}, [&](std::size_t j) { return numbers[j]; });
        if (at != ends.begin()) before[i] = *(at - 1);
        if (at == ends.end())
            ends.push_back(i);
        else
            *at = i;
    }
    std::vector<bool> stays(numbers.size());
    for (std::size_t i = ends.empty() ? kNone : ends.back(); i != kNone; i = before[i]) stays[i] = true;
    return stays;
}

}  // namespace

std::vector<Placement> childOrder(const ChildList& now, std::span<const OrderedChild> wanted, ObjectId parent,
                                  const std::function<bool(ObjectId)>& goes) {
    std::vector<OrderedChild> order;
    std::vector<std::int64_t> places;
    for (const OrderedChild& child : wanted) {
        if (child.was != OrderedChild::kNew && !now.contains(child.id)) continue;
        order.push_back(child);
        if (child.was >= 0) places.push_back(child.was);
    }
    const std::vector<bool> stays = longestIncreasing(places);

    // What comes behind each that stays; the first ones behind none.
    std::vector<Placement> placements;
    std::unordered_set<ObjectId> moved;
    std::vector<ObjectId> first;
    std::unordered_map<ObjectId, std::vector<ObjectId>> behind;
    ObjectId anchor, next;  // the last that stays, and the first of all
    for (std::size_t i = 0, place = 0; i < order.size(); ++i) {
        const bool isNew = order[i].was == OrderedChild::kNew;
        const bool stands = order[i].was == OrderedChild::kStays || (!isNew && stays[place]);
        place += order[i].was >= 0 ? 1 : 0;
        if (stands) {
            anchor = order[i].id;
            if (!next) next = anchor;
            continue;
        }
        (anchor ? behind[anchor] : first).push_back(order[i].id);
        if (isNew) continue;
        moved.insert(order[i].id);
        placements.push_back({order[i].id, ObjectId()});
    }
    std::size_t index = 0, left = 0;
    for (const ObjectId child : now) left += goes(child) || moved.contains(child) ? 0 : 1;
    const auto put = [&](const std::vector<ObjectId>& children) {
        for (const ObjectId child : children)
            placements.push_back({child, parent, left == 0 ? Placement::kLast : static_cast<std::uint32_t>(index++)});
    };
    for (const ObjectId child : now) {
        if (goes(child) || moved.contains(child)) continue;
        if (child == next) put(first);
        ++index;
        --left;
        if (const auto those = behind.find(child); those != behind.end()) put(those->second);
    }
    if (!next) put(first);
    return placements;
}

}  // namespace tessera
