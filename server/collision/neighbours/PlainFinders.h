/// The plain ways: everybody against everybody, and sorting along one axis.
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

/// Sorts the boxes along one axis and sweeps over them (D. Baraff, 1992; J. D. Cohen et al., I-COLLIDE, 1995). The
/// order of the last call is kept, so that a scene in which little moves is sorted in linear time; nothing is done at
/// all where nothing moved. The axis is the one along which the boxes are spread most, chosen anew now and then.
class SweepAndPrune final : public NeighbourFinder {
public:
    using NeighbourFinder::move;
    void reset(std::span<const Box> boxes, InteractionTable table) override;
    void move(std::uint32_t item, const Box& box) override;
    void regroup(std::span<const std::uint32_t> items, std::span<const NeighbourPair> known,
                 const InteractionTable& table) override;
    [[nodiscard]] bool changes(std::vector<NeighbourPair>&, std::vector<NeighbourPair>&) override { return false; }
    [[nodiscard]] std::span<const NeighbourPair> pairs() override;

private:
    static constexpr std::size_t kSweepsPerAxis = 64;

    void chooseAxis();
    void sort();
    void sweep();

    std::vector<Box> boxes_;
    InteractionTable table_;
    std::vector<std::uint32_t> order_;  ///< by lower bound on axis_, then by index
    std::vector<NeighbourPair> pairs_;
    std::size_t moved_ = 0;  ///< since the last sort
    std::size_t sweeps_ = 0;
    int axis_ = 0;
    bool upToDate_ = false;
};

}  // namespace tessera
