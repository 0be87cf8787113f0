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

/// Of boxes that meet and are of interest to each other, by looking at all of them.
template <typename Relevant>
[[nodiscard]] std::vector<PairChange> beginsOneByOne(std::span<const Box> boxes, const Relevant& relevant) {
    std::vector<PairChange> begins;
    for (std::uint32_t a = 0; a < boxes.size(); ++a) {
        if (boxes[a].empty()) continue;
        for (std::uint32_t b = a + 1; b < boxes.size(); ++b)
            if (!boxes[b].empty() && boxes[a].overlaps(boxes[b]) && relevant(a, b))
                begins.push_back(pairChange(a, b, true));
    }
    return begins;
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
        sound_ = true;
    }
    /// Every pair that began was not there yet, every one that ended was. Where that is not so the changes were found
    /// from something that is not true, and others may not have been found: nothing is held then, until `clear`, and
    /// all is to be searched anew. Very few changes are looked at only when they are merged in.
    [[nodiscard]] bool sound() const { return sound_; }

    /// Takes in the changes of all lists, in any order: what begins is not there yet, what ends is; a pair that does
    /// both stays as it is, and what comes twice counts once. Items are below `items`.
    void apply(std::span<const std::vector<PairChange>* const> lists, std::size_t items, Workers* workers);
    void apply(const std::vector<PairChange>& changes, std::size_t items, Workers* workers) {
        const std::vector<PairChange>* const list = &changes;
        apply(std::span(&list, 1), items, workers);
    }
    /// What the last `apply` changed in the end, ascending.
    [[nodiscard]] std::span<const PairChange> lastChanges() const { return last_; }

private:
    struct Part;

    void applyFew(std::span<const std::vector<PairChange>* const> lists, std::size_t items, Workers* workers);
    void applyMany(std::span<const std::vector<PairChange>* const> lists, std::size_t items, Workers* workers);
    void mergeLate(Workers* workers);

    void sortPart(Part& part);
    void mergePart(Part& part);

    std::vector<NeighbourPair> pairs_, merged_;
    std::vector<PairChange> changes_, last_;
    std::vector<PairChange> late_, lateMerged_;  // not in pairs_ yet; ascending, each pair once
    std::size_t items_ = 1;
    bool sound_ = true;
    std::vector<std::uint32_t> bucketEnds_;
    std::vector<Part> parts_;
};

/// A share of the buckets of a's, and what belongs to it.
struct PairSet::Part {
    std::size_t firstBucket, lastBucket;  ///< of changes
    std::size_t firstPair, lastPair;      ///< of the pairs so far
    std::size_t firstChange, lastChange;  ///< after pairs that both end and begin are out
    std::size_t out;                      ///< where it begins in the merged pairs
    std::size_t merged;                   ///< how many they are
    bool sound;                           ///< else nothing is merged
};

}  // namespace tessera::neighbours
