#pragma once

#include <vector>

#include "server/collision/neighbours/NeighbourFinder.h"

namespace tessera {

/// Tests everybody against everybody: the baseline.
class AllPairs final : public NeighbourFinder {
public:
    using NeighbourFinder::move;
    void reset(std::span<const Box> boxes, InteractionTable table) override;
    void move(std::uint32_t item, const Box& box) override;
    void regroup(std::span<const std::uint32_t> items, std::span<const NeighbourPair> known,
                 const InteractionTable& table) override;
    [[nodiscard]] bool changes(std::vector<NeighbourPair>&, std::vector<NeighbourPair>&) override { return false; }
    [[nodiscard]] std::span<const NeighbourPair> pairs() override;

private:
    std::vector<Box> boxes_;
    InteractionTable table_;
    std::vector<NeighbourPair> pairs_;
};

}  // namespace tessera
