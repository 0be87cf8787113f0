#include "server/collision/neighbours/PlainFinders.h"

#include <utility>

namespace tessera {

void AllPairs::reset(std::span<const Box> boxes, InteractionTable table) {
    boxes_.assign(boxes.begin(), boxes.end());
    table_ = std::move(table);
}

void AllPairs::move(std::uint32_t item, const Box& box) {
    boxes_[item] = box;
}

void AllPairs::regroup(std::span<const std::uint32_t> items, std::span<const NeighbourPair>,
                       const InteractionTable& table) {
    std::vector<Box> boxes = std::move(boxes_);
    boxes.resize(table.groupOf.size());
    InteractionTable own = table;
    for (const std::uint32_t item : items) boxes[item] = {};
    for (std::uint32_t& group : own.groupOf)
        if (group == InteractionTable::kNoGroup) group = 0;  // whatever: its box is empty
    reset(boxes, std::move(own));
}

std::span<const NeighbourPair> AllPairs::pairs() {
    pairs_.clear();
    const auto n = static_cast<std::uint32_t>(boxes_.size());
    for (std::uint32_t a = 0; a < n; ++a) {
        if (boxes_[a].empty()) continue;
        for (std::uint32_t b = a + 1; b < n; ++b)
            if (table_.relevant(a, b) && !boxes_[b].empty() && boxes_[a].overlaps(boxes_[b])) pairs_.push_back({a, b});
    }
    return pairs_;
}

}  // namespace tessera
