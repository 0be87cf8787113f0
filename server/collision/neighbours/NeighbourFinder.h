/// Neighbour finding, the broad phase: whose boxes meet?
#pragma once

#include <compare>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "common/math/Box.h"

namespace tessera {

class Workers;

/// Items by index, a < b.
struct NeighbourPair {
    std::uint32_t a = 0;
    std::uint32_t b = 0;
    auto operator<=>(const NeighbourPair&) const = default;
};

/// Who is of interest to whom. Items fall into groups of equal interests.
struct InteractionTable {
    static constexpr std::uint32_t kNoGroup = 0xffffffffu;  ///< of a number that no item has

    std::vector<std::uint32_t> groupOf;  ///< per item
    std::vector<std::uint32_t> bodyOf;  ///< per item: items of one body never interact; none: all are of different ones
    std::vector<bool> active;           ///< per group: has interests of its own; two passive groups never interact
    std::vector<bool> interacts;        ///< groups × groups, symmetric

    [[nodiscard]] bool relevant(std::uint32_t itemA, std::uint32_t itemB) const {
        return interacts[groupOf[itemA] * active.size() + groupOf[itemB]] &&
               (bodyOf.empty() || bodyOf[itemA] != bodyOf[itemB]);
    }
    [[nodiscard]] bool activeItem(std::uint32_t item) const { return active[groupOf[item]]; }
    /// One group of n items, each of interest to each.
    [[nodiscard]] static InteractionTable everybody(std::size_t n) {
        return {std::vector<std::uint32_t>(n, 0), {}, {true}, {true}};
    }
};

/// Finds the pairs of relevant items whose boxes overlap, in double, without tolerance: `!a.empty() && !b.empty() &&
/// a.overlaps(b)`. So touching counts, an empty box overlaps nothing, a box with a NaN in it is empty, and an infinite
/// box overlaps whatever lies in its range. Every finder returns the same pairs in the same, ascending, order, for any
/// number of threads. At most 2^30 items. One thread at a time.
class NeighbourFinder {
public:
    virtual ~NeighbourFinder() = default;

    /// Starts afresh with these items.
    virtual void reset(std::span<const Box> boxes, InteractionTable table) = 0;
    virtual void move(std::uint32_t item, const Box& box) = 0;
    /// As many moves: boxes[i] is the new box of items[i]; of two for one item the later counts.
    virtual void move(std::span<const std::uint32_t> items, std::span<const Box> boxes);
    /// How many items there may be without everything being found afresh. Before `reset`; a hint.
    virtual void expect(std::size_t items) { (void)items; }
    /// Takes another table, in which these items (their numbers may be new) are of another group or body, or of none
    /// (kNoGroup: gone). Their boxes are empty from now on; `known` are all the pairs that they have in pairs(). What
    /// the table says of two groups may be different only where all items of one of them are given.
    virtual void regroup(std::span<const std::uint32_t> items, std::span<const NeighbourPair> known,
                         const InteractionTable& table) = 0;
    /// What has begun and ended since the last call of this or of pairs(), but for what `regroup` was told, ascending.
    /// False where everything was found afresh, so that pairs() has to be read.
    [[nodiscard]] virtual bool changes(std::vector<NeighbourPair>& begun, std::vector<NeighbourPair>& ended) = 0;
    /// Valid until the next call of any member.
    [[nodiscard]] virtual std::span<const NeighbourPair> pairs() = 0;
};

enum class NeighbourMethod : std::uint8_t {
    kAllPairs,       ///< the baseline
    kSweepAndPrune,  ///< along one axis
    kGrid,           ///< boxes of similar size, spread evenly
    kTree,           ///< anything, also clusters and mixed sizes
    kAuto,           ///< one of these, by what it sees
};
[[nodiscard]] std::string_view name(NeighbourMethod method);

struct NeighbourOptions {
    NeighbourMethod method = NeighbourMethod::kAuto;
    Workers* workers = nullptr;  ///< to share the work of grid and tree; must outlive the finder
};

[[nodiscard]] std::unique_ptr<NeighbourFinder> makeNeighbourFinder(const NeighbourOptions& options = {});

}  // namespace tessera
