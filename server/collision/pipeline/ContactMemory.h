/// What is known about pairs of parts at rest: asked once, remembered until one of them moves.
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "server/collision/mesh/TreeQueries.h"
#include "server/collision/pipeline/ObjectHandler.h"

namespace tessera {

struct PairState {
    std::uint64_t versionA = 0, versionB = 0;
    FacePairs faces;  ///< a: of part A
    std::uint64_t usedInStep = 0;
};

/// Not thread-safe. Part numbers are those of one generation of the object handler; `clear` at a new one.
class ContactMemory {
public:
    /// The intersecting faces of two solid parts in their present poses. An incomplete answer is not remembered.
    [[nodiscard]] const PairState& state(const ObjectHandler& handler, std::uint32_t partA, std::uint32_t partB,
                                         QueryWork& work, std::uint64_t& queries);
    /// Forgets pairs that nobody has asked about since the last call.
    void endStep();
    void clear() { pairs_.clear(); }
    [[nodiscard]] std::size_t size() const { return pairs_.size(); }

private:
    std::unordered_map<std::uint64_t, PairState> pairs_;
    std::uint64_t step_ = 1;
};

}  // namespace tessera
