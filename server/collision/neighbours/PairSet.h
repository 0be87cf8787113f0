/// The pairs of a finder, kept from frame to frame.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/collision/neighbours/NeighbourFinder.h"

namespace tessera::neighbours {

/// A pair that begins or ends, as one number that sorts by (a, b).
using PairChange = std::uint64_t;
[[nodiscard]] constexpr PairChange pairChange(std::uint32_t a, std::uint32_t b, bool begins) {
    return std::uint64_t{a} << 33U | std::uint64_t{b} << 1U | static_cast<std::uint64_t>(begins);
}

/// Sorted pairs. A frame changes few of them, so that the sorted changes are merged in instead of sorting the pairs;
/// and very few are merged in only when the pairs are asked for, or many have come together. One thread at a time.
class PairSet {
public:
    [[nodiscard]] std::span<const NeighbourPair> pairs(Workers* workers) {
        mergeLate(workers);
        return pairs_;
    }
    [[nodiscard]] bool contains(std::uint32_t a, std::uint32_t b) const;
    void clear() {
        pairs_.clear();
        late_.clear();
    }

    /// Takes in the changes of all lists, in any order: what begins must not be there yet, what ends must be; a pair
    /// that does both stays as it is. Items are below `items`.
    void apply(std::span<const std::vector<PairChange>* const> lists, std::size_t items, Workers* workers);
    /// What the last `apply` changed in the end, ascending.
    [[nodiscard]] std::span<const PairChange> lastChanges() const { return last_; }

private:
    struct Part;

    void applyFew(std::span<const std::vector<PairChange>* const> lists, std::size_t items, Workers* workers);
    void applyMany(std::span<const std::vector<PairChange>* const> lists, std::size_t items, Workers* workers);
    void mergeLate(Workers* workers);

    void sortPart(Part& part);
    void mergePart(const Part& part);

    std::vector<NeighbourPair> pairs_, merged_;
    std::vector<PairChange> changes_, last_;
    std::vector<PairChange> late_, lateMerged_;  // not in pairs_ yet; ascending, each pair once
    std::size_t items_ = 1;
    std::vector<std::uint32_t> bucketEnds_;
    std::vector<Part> parts_;
};

/// A share of the buckets of a's, and what belongs to it.
struct PairSet::Part {
    std::size_t firstBucket, lastBucket;  ///< of changes
    std::size_t firstPair, lastPair;      ///< of the pairs so far
    std::size_t firstChange, lastChange;  ///< after pairs that both end and begin are out
    std::size_t out;                      ///< where it begins in the merged pairs
};

}  // namespace tessera::neighbours
