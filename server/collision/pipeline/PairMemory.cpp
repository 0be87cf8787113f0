#include "server/collision/pipeline/PairMemory.h"

#include <algorithm>
#include <unordered_map>
#include <utility>

namespace tessera {
namespace {

NeighbourPair keyOf(const PairState& state) {
    return {std::min(state.a, state.b), std::max(state.a, state.b)};
}

}  // namespace

/// The handler has numbered its parts anew: finds the known pairs by their nodes.
void PairMemory::renumber(const ObjectHandler& handler) {
    std::unordered_map<ObjectId, std::uint32_t> partOf;
    partOf.reserve(handler.parts().size());
    for (std::uint32_t i = 0; i < handler.parts().size(); ++i) partOf.emplace(handler.parts()[i].node, i);
    for (PairState& state : before_) {
        const auto a = partOf.find(state.nodeA), b = partOf.find(state.nodeB);
        state.a = a == partOf.end() ? kNobody : a->second;
        state.b = b == partOf.end() ? kNobody : b->second;
    }
    std::ranges::sort(before_, [](const PairState& x, const PairState& y) { return keyOf(x) < keyOf(y); });
}

void PairMemory::align(std::span<const NeighbourPair> near, const ObjectHandler& handler) {
    std::swap(states_, before_);
    if (generation_ != handler.generation()) {
        generation_ = handler.generation();
        renumber(handler);
    }
    states_.clear();
    states_.reserve(near.size());
    auto known = before_.begin();
    for (const NeighbourPair& pair : near) {
        while (known != before_.end() && keyOf(*known) < pair) ++known;
        const bool firstIsObject = handler.relation(pair.a, pair.b).firstIsObject;
        const std::uint32_t a = firstIsObject ? pair.a : pair.b, b = firstIsObject ? pair.b : pair.a;
        if (known != before_.end() && keyOf(*known) == pair && known->a == a) {
            states_.push_back(std::move(*known));
            ++known;
            continue;
        }
        PairState& state = states_.emplace_back();
        state.a = a;
        state.b = b;
        state.nodeA = handler.parts()[a].node;
        state.nodeB = handler.parts()[b].node;
    }
}

}  // namespace tessera
