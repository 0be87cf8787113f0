#include "server/collision/neighbours/PairSet.h"

#include <algorithm>

#include "common/base/Error.h"
#include "server/collision/neighbours/Tasks.h"

namespace tessera::neighbours {

namespace {

constexpr std::size_t kPerBucket = 8;
constexpr std::size_t kPerPart = 2048;
constexpr std::size_t kFew = 4096, kFewOf = 16;  // changes that are but noted: so many, and one for so many pairs
constexpr std::size_t kLate = 256;

/// Short lists by insertion; long ones come from one item that meets very many.
void sortShort(PairChange* first, PairChange* last) {
    if (last - first > 48) {
        std::sort(first, last);
        return;
    }
    for (PairChange* i = first + 1; i < last; ++i) {
        const PairChange value = *i;
        PairChange* k = i;
        for (; k > first && value < k[-1]; --k) *k = k[-1];
        *k = value;
    }
}

PairChange key(const NeighbourPair& pair) {
    return pairChange(pair.a, pair.b, false);
}

/// Drops what both ends and begins, in any order; the others ascending, each once.
void sortNet(std::vector<PairChange>& changes) {
    std::sort(changes.begin(), changes.end());
    changes.erase(std::unique(changes.begin(), changes.end()), changes.end());
    std::size_t kept = 0;
    for (std::size_t i = 0; i < changes.size(); ++i) {
        if (kept > 0 && changes[kept - 1] >> 1U == changes[i] >> 1U)
            --kept;
        else
            changes[kept++] = changes[i];
    }
    changes.resize(kept);
}

}  // namespace

bool PairSet::contains(std::uint32_t a, std::uint32_t b) const {
    const PairChange ends = pairChange(a, b, false);
    if (const auto late = std::lower_bound(late_.begin(), late_.end(), ends);
        late != late_.end() && *late >> 1U == ends >> 1U)
        return (*late & 1U) != 0;
    return std::binary_search(pairs_.begin(), pairs_.end(), NeighbourPair{a, b});
}

void PairSet::apply(std::span<const std::vector<PairChange>* const> lists, std::size_t items, Workers* workers) {
    std::size_t total = 0;
    for (const std::vector<PairChange>* list : lists) total += list->size();
    last_.clear();
    items_ = std::max<std::size_t>(items, 1);
    if (total == 0) return;
    if (total < kFew && total * kFewOf < pairs_.size()) {
        applyFew(lists, items, workers);
    } else {
        mergeLate(workers);
        applyMany(lists, items, workers);
    }
}

/// Only noted down.
void PairSet::applyFew(std::span<const std::vector<PairChange>* const> lists, std::size_t, Workers* workers) {
    for (const std::vector<PairChange>* list : lists) last_.insert(last_.end(), list->begin(), list->end());
    sortNet(last_);
    lateMerged_.clear();
    auto late = late_.begin();
    for (const PairChange change : last_) {
        while (late != late_.end() && *late >> 1U < change >> 1U) lateMerged_.push_back(*late++);
        if (late != late_.end() && *late == change) {
            sound_ = false;  // it begins twice, or ends twice
        } else if (late != late_.end() && *late >> 1U == change >> 1U) {
            ++late;  // as it was
        } else {
            lateMerged_.push_back(change);
        }
    }
    lateMerged_.insert(lateMerged_.end(), late, late_.end());
    late_.swap(lateMerged_);
    if (late_.size() > kLate + pairs_.size() / kFewOf) mergeLate(workers);
}

void PairSet::mergeLate(Workers* workers) {
    if (late_.empty()) return;
    const std::vector<PairChange> late = std::move(late_), told = std::move(last_);
    late_.clear();
    const std::vector<PairChange>* const list = &late;
    applyMany(std::span(&list, 1), items_, workers);
    last_ = told;
}

void PairSet::applyMany(std::span<const std::vector<PairChange>* const> lists, std::size_t items, Workers* workers) {
    std::size_t total = 0;
    for (const std::vector<PairChange>* list : lists) total += list->size();
    TESSERA_CHECK(total < 0xffff'ffffU, "more pairs than can be counted");

    // Counted into buckets of neighbouring a's first, so that only short lists are left to sort.
    unsigned shift = 33;
    while (((items - 1) >> (shift - 33)) > total / kPerBucket) ++shift;
    const std::size_t buckets = ((items - 1) >> (shift - 33)) + 1;
    bucketEnds_.assign(buckets + 1, 0);
    for (const std::vector<PairChange>* list : lists)
        for (const PairChange change : *list) ++bucketEnds_[(change >> shift) + 1];
    for (std::size_t b = 0; b < buckets; ++b) bucketEnds_[b + 1] += bucketEnds_[b];
    changes_.resize(total);
    // Each bucket's number is its beginning now and its end afterwards.
    for (const std::vector<PairChange>* list : lists)
        for (const PairChange change : *list) changes_[bucketEnds_[change >> shift]++] = change;

    const std::size_t parts =
        std::clamp<std::size_t>((total + pairs_.size()) / kPerPart, 1, std::min<std::size_t>(64, buckets));
    parts_.resize(parts);
    std::size_t pair = 0;
    for (std::size_t i = 0; i < parts; ++i) {
        Part& part = parts_[i];
        part.firstBucket = buckets * i / parts;
        part.lastBucket = buckets * (i + 1) / parts;
        part.firstPair = pair;
        const PairChange end = static_cast<PairChange>(part.lastBucket) << shift;
        pair = static_cast<std::size_t>(
            std::lower_bound(pairs_.begin() + static_cast<std::ptrdiff_t>(pair), pairs_.end(), end,
                             [](const NeighbourPair& p, PairChange value) { return key(p) < value; }) -
            pairs_.begin());
        part.lastPair = pair;
    }
    runTasks(workers, parts, [&](std::size_t i) { sortPart(parts_[i]); });
    std::size_t out = 0;
    for (Part& part : parts_) {
        part.out = out;
        out += part.merged;
    }
    merged_.resize(out);
    runTasks(workers, parts, [&](std::size_t i) { mergePart(parts_[i]); });
    pairs_.swap(merged_);
    last_.clear();
    for (const Part& part : parts_) sound_ = sound_ && part.sound;
    if (!sound_) pairs_.clear();
    for (const Part& part : parts_)
        last_.insert(last_.end(), changes_.begin() + static_cast<std::ptrdiff_t>(part.firstChange),
                     changes_.begin() + static_cast<std::ptrdiff_t>(part.lastChange));
}

/// Sorts the part's changes; says how many its pairs will be.
void PairSet::sortPart(Part& part) {
    const auto beginOf = [&](std::size_t bucket) { return bucket == 0 ? 0 : bucketEnds_[bucket - 1]; };
    part.firstChange = beginOf(part.firstBucket);
    const std::size_t last = beginOf(part.lastBucket);
    for (std::size_t b = part.firstBucket; b < part.lastBucket; ++b)
        sortShort(changes_.data() + beginOf(b), changes_.data() + bucketEnds_[b]);
    std::size_t kept = part.firstChange;
    std::size_t begins = 0;
    for (std::size_t i = part.firstChange; i < last; ++i) {
        while (i + 1 < last && changes_[i] == changes_[i + 1]) ++i;
        if (i + 1 < last && changes_[i] + 1 == changes_[i + 1] && (changes_[i] & 1U) == 0) {
            do ++i;  // ends in one place and begins in another
            while (i + 1 < last && changes_[i] == changes_[i + 1]);
            continue;
        }
        begins += changes_[i] & 1U;
        changes_[kept++] = changes_[i];
    }
    part.lastChange = kept;
    const std::size_t ends = kept - part.firstChange - begins, before = part.lastPair - part.firstPair;
    part.sound = ends <= before;
    part.merged = part.sound ? before + begins - ends : 0;
}

void PairSet::mergePart(Part& part) {
    if (!part.sound) return;
    const NeighbourPair* from = pairs_.data() + part.firstPair;
    const NeighbourPair* const last = pairs_.data() + part.lastPair;
    NeighbourPair* to = merged_.data() + part.out;
    NeighbourPair* const end = to + part.merged;
    part.sound = false;
    for (std::size_t i = part.firstChange; i < part.lastChange; ++i) {
        const PairChange change = changes_[i];
        const PairChange place = change & ~PairChange{1};
        const NeighbourPair* stays = from;
        while (stays != last && key(*stays) < place) ++stays;
        const bool there = stays != last && key(*stays) == place, begins = (change & 1U) != 0;
        // What does not end has no room.
        if (there == begins || stays - from + begins > end - to) return;
        to = std::copy(from, stays, to);
        from = stays;
        if (begins)
            *to++ = {static_cast<std::uint32_t>(change >> 33U), static_cast<std::uint32_t>(change >> 1U)};
        else
            ++from;
    }
    if (last - from != end - to) return;
    std::copy(from, last, to);
    part.sound = true;
}

}  // namespace tessera::neighbours
