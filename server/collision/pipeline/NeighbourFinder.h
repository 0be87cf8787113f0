/// Neighbour finding, the broad phase: whose boxes meet?
#pragma once

#include <compare>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/math/Box.h"

namespace tessera {

/// Items by index, a < b.
struct NeighbourPair {
    std::uint32_t a = 0;
    std::uint32_t b = 0;
    auto operator<=>(const NeighbourPair&) const = default;
};

/// Who is of interest to whom. Items fall into groups of equal interests.
struct InteractionTable {
    std::vector<std::uint32_t> groupOf;  ///< per item
    std::vector<bool> active;            ///< per group: has interests of its own; two passive groups never interact
    std::vector<bool> interacts;         ///< groups × groups, symmetric

    [[nodiscard]] bool relevant(std::uint32_t itemA, std::uint32_t itemB) const {
        return interacts[groupOf[itemA] * active.size() + groupOf[itemB]];
    }
    [[nodiscard]] bool activeItem(std::uint32_t item) const { return active[groupOf[item]]; }
};

/// Finds the pairs of relevant items whose boxes overlap (touching counts; an empty box overlaps nothing). Every finder
/// returns the same pairs in the same, ascending, order.
class NeighbourFinder {
public:
    virtual ~NeighbourFinder() = default;

    /// Starts afresh with these items.
    virtual void reset(std::span<const Box> boxes, InteractionTable table) = 0;
    virtual void move(std::uint32_t item, const Box& box) = 0;
    /// Valid until the next call of any member.
    [[nodiscard]] virtual std::span<const NeighbourPair> pairs() = 0;
};

/// Tests everybody against everybody: the baseline.
class AllPairs final : public NeighbourFinder {
public:
    void reset(std::span<const Box> boxes, InteractionTable table) override;
    void move(std::uint32_t item, const Box& box) override;
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
    void reset(std::span<const Box> boxes, InteractionTable table) override;
    void move(std::uint32_t item, const Box& box) override;
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
