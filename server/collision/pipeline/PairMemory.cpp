#include "server/collision/pipeline/PairMemory.h"

#include <algorithm>
#include <utility>

namespace tessera {

void PairMemory::clear() {
    *this = {};
    allEnded_ = true;
}

std::uint32_t PairMemory::find(const NeighbourPair& pair) const {
    const std::span<const std::uint32_t> ofA = pairsOf(pair.a), ofB = pairsOf(pair.b);
    for (const std::uint32_t number : ofA.size() < ofB.size() ? ofA : ofB) {
        const PairState& state = states_[number];
        if (std::min(state.a, state.b) == pair.a && std::max(state.a, state.b) == pair.b) return number;
    }
    return PairState::kNowhere;
}

/// Which is A, and who they are; what was known of others is forgotten.
void PairMemory::name(PairState& state, const NeighbourPair& pair, const ObjectHandler& handler) const {
    const bool inOrder = handler.before(pair.a, pair.b);
    const std::uint32_t first = inOrder ? pair.a : pair.b, second = inOrder ? pair.b : pair.a;
    const bool firstIsObject = handler.relation(first, second).firstIsObject;
    const std::uint32_t a = firstIsObject ? first : second, b = firstIsObject ? second : first;
    const ObjectId nodeA = handler.parts()[a].node, nodeB = handler.parts()[b].node;
    if (state.a == a && state.nodeA == nodeA && state.nodeB == nodeB) return;
    const bool swapped = state.a == b && state.nodeA;  // the places in the lists go with the parts
    PairState fresh;
    fresh.a = a;
    fresh.b = b;
    fresh.nodeA = nodeA;
    fresh.nodeB = nodeB;
    fresh.inA = swapped ? state.inB : state.inA;
    fresh.inB = swapped ? state.inA : state.inB;
    fresh.inTold = state.inTold;
    fresh.loose = state.loose;
    fresh.stale = state.stale;
    state = std::move(fresh);
}

void PairMemory::begin(const NeighbourPair& pair, const ObjectHandler& handler) {
    std::uint32_t number = find(pair);
    if (number != PairState::kNowhere) {
        states_[number].loose = false;
        name(states_[number], pair, handler);
        makeStale(number);
        return;
    }
    if (free_.empty()) {
        number = static_cast<std::uint32_t>(states_.size());
        states_.emplace_back();
    } else {
        number = free_.back();
        free_.pop_back();
    }
    PairState& state = states_[number];
    state.a = PairState::kNowhere;
    name(state, pair, handler);
    const std::size_t parts = std::size_t{pair.b} + 1;
    if (pairsOfPart_.size() < parts) pairsOfPart_.resize(parts);
    for (const auto& [part, at] : {std::pair(state.a, &state.inA), std::pair(state.b, &state.inB)}) {
        *at = static_cast<std::uint32_t>(pairsOfPart_[part].size());
        pairsOfPart_[part].push_back(number);
    }
    ++size_;
    makeStale(number);
}

void PairMemory::end(std::uint32_t number) {
    PairState& state = states_[number];
    for (const auto& [part, at] : {std::pair(state.a, state.inA), std::pair(state.b, state.inB)}) {
        std::vector<std::uint32_t>& others = pairsOfPart_[part];
        PairState& last = states_[others.back()];
        (last.a == part ? last.inA : last.inB) = at;
        others[at] = others.back();
        others.pop_back();
    }
    tell(number, false);
    ended_.push_back(number);
    const bool stale = state.stale;
    state = {};
    state.stale = stale;  // it stays in that list
    free_.push_back(number);
    --size_;
}

std::vector<NeighbourPair> PairMemory::loosen(std::span<const std::uint32_t> parts) {
    std::vector<NeighbourPair> known;
    for (const std::uint32_t part : parts)
        for (const std::uint32_t number : pairsOf(part)) {
            PairState& state = states_[number];
            if (std::exchange(state.loose, true)) continue;
            loose_.push_back(number);
            known.push_back({std::min(state.a, state.b), std::max(state.a, state.b)});
        }
    return known;
}

void PairMemory::dropLoose() {
    for (const std::uint32_t number : loose_)
        if (states_[number].loose) end(number);
    loose_.clear();
}

void PairMemory::follow(std::span<const NeighbourPair> begun, std::span<const NeighbourPair> ended,
                        const ObjectHandler& handler) {
    for (const NeighbourPair& pair : ended)
        if (const std::uint32_t number = find(pair); number != PairState::kNowhere && !states_[number].loose)
            end(number);
    for (const NeighbourPair& pair : begun) begin(pair, handler);
    dropLoose();
}

void PairMemory::align(std::span<const NeighbourPair> all, const ObjectHandler& handler) {
    for (std::uint32_t number = 0; number < states_.size(); ++number)
        if (states_[number].nodeA && !std::exchange(states_[number].loose, true)) loose_.push_back(number);
    for (const NeighbourPair& pair : all) begin(pair, handler);
    dropLoose();
}

void PairMemory::reconsider(std::span<const std::uint32_t> parts, const ObjectHandler& handler) {
    for (const std::uint32_t part : parts)
        for (const std::uint32_t number : pairsOf(part)) {
            PairState& state = states_[number];
            if (!state.loose) name(state, {std::min(state.a, state.b), std::max(state.a, state.b)}, handler);
            makeStale(number);
        }
}

void PairMemory::moved(std::span<const std::uint32_t> parts) {
    for (const std::uint32_t part : parts)
        for (const std::uint32_t number : pairsOf(part)) makeStale(number);
}

void PairMemory::makeStale(std::uint32_t pair) {
    if (std::exchange(states_[pair].stale, true)) return;
    stale_.push_back(pair);
}

std::vector<std::uint32_t> PairMemory::takeStale(const ObjectHandler& handler) {
    for (const std::uint32_t pair : stale_) states_[pair].stale = false;
    std::erase_if(stale_, [&](std::uint32_t pair) { return !states_[pair].nodeA; });
    sort(stale_, handler);
    return std::exchange(stale_, {});
}

void PairMemory::sortOnce(std::vector<std::uint32_t>& pairs, const ObjectHandler& handler) const {
    std::sort(pairs.begin(), pairs.end());
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    sort(pairs, handler);
}

bool PairMemory::before(std::uint32_t x, std::uint32_t y, const ObjectHandler& handler) const {
    const auto ends = [&](std::uint32_t pair) {
        const PairState& state = states_[pair];
        return handler.before(state.a, state.b) ? std::pair(state.a, state.b) : std::pair(state.b, state.a);
    };
    const auto [x1, x2] = ends(x);
    const auto [y1, y2] = ends(y);
    return x1 != y1 ? handler.before(x1, y1) : handler.before(x2, y2);
}

void PairMemory::sort(std::vector<std::uint32_t>& pairs, const ObjectHandler& handler) const {
    // Where the ends stand is looked up once each, not at every comparison.
    struct Placed {
        std::uint64_t first = 0, second = 0;
        std::uint32_t pair = 0;
    };
    std::vector<Placed> placed;
    placed.reserve(pairs.size());
    for (const std::uint32_t pair : pairs) {
        const auto [first, second] = std::minmax({handler.rank(states_[pair].a), handler.rank(states_[pair].b)});
        placed.push_back({first, second, pair});
    }
    const auto inOrder = [](const Placed& x, const Placed& y) {
        return x.first != y.first ? x.first < y.first : x.second < y.second;
    };
    if (std::is_sorted(placed.begin(), placed.end(), inOrder)) return;
    std::sort(placed.begin(), placed.end(), inOrder);
    std::ranges::transform(placed, pairs.begin(), &Placed::pair);
}

void PairMemory::tell(std::uint32_t pair, bool yes) {
    std::uint32_t& at = states_[pair].inTold;
    if (yes == (at != PairState::kNowhere)) return;
    if (yes) {
        at = static_cast<std::uint32_t>(told_.size());
        told_.push_back(pair);
        return;
    }
    states_[told_.back()].inTold = at;
    told_[at] = told_.back();
    told_.pop_back();
    at = PairState::kNowhere;
}

std::optional<std::vector<std::uint32_t>> PairMemory::takeEnded() {
    if (std::exchange(allEnded_, false)) {
        ended_.clear();
        return std::nullopt;
    }
    return std::exchange(ended_, {});
}

}  // namespace tessera
