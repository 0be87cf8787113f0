#include "server/collision/objects/DocumentOrder.h"

#include <algorithm>
#include <cmath>

#include "common/base/Error.h"

namespace tessera {

namespace {

constexpr std::uint64_t kEnd = std::uint64_t{1} << 62;  // labels are below
constexpr std::uint64_t kStride = 1 << 20;              // what is appended leaves so much room

/// How many labels of an aligned range of 2^level may be in use.
double roomIn(int level) {
    return std::pow(1.4, level);
}

}  // namespace

void DocumentOrder::insert(std::uint32_t place, std::uint32_t after) {
    if (entries_.size() < 2 * std::size_t{place} + 2) entries_.resize(2 * std::size_t{place} + 2);
    entries_[open(place)] = {0, kNone, close(place)};
    entries_[close(place)] = {kStride, open(place), kNone};
    if (after != kNone) link(open(place), close(place), after, 2);
}

void DocumentOrder::cut(std::uint32_t place) {
    Entry &first = entries_[open(place)], &last = entries_[close(place)];
    if (first.previous != kNone) entries_[first.previous].next = last.next;
    if (last.next != kNone) entries_[last.next].previous = first.previous;
    first.previous = last.next = kNone;
}

void DocumentOrder::paste(std::uint32_t place, std::uint32_t after) {
    std::size_t count = 1;
    for (std::uint32_t at = open(place); at != close(place); at = next(at)) ++count;
    link(open(place), close(place), after, count);
}

void DocumentOrder::link(std::uint32_t first, std::uint32_t last, std::uint32_t after, std::size_t count) {
    const std::uint32_t behind = entries_[after].next;
    entries_[after].next = first;
    entries_[first].previous = after;
    entries_[last].next = behind;
    if (behind != kNone) entries_[behind].previous = last;
    const std::uint64_t low = label(after), high = behind == kNone ? kEnd : label(behind);
    const std::uint64_t step = std::min<std::uint64_t>((high - low) / (count + 1), kStride);
    if (step == 0) {
        spreadOut(first, last, count);
        return;
    }
    std::uint64_t next = low;
    for (std::uint32_t at = first;; at = entries_[at].next) {
        entries_[at].label = next += step;
        if (at == last) break;
    }
}

/// Gives labels to what stands from `first` to `last` (none of them has one), and others to neighbours: those in the
/// smallest range of labels that is not crowded.
void DocumentOrder::spreadOut(std::uint32_t first, std::uint32_t last, std::size_t count) {
    const std::uint64_t here = label(entries_[first].previous);
    for (int level = 1; level <= 62; ++level) {
        const std::uint64_t width = std::uint64_t{1} << level, low = here & ~(width - 1);
        while (entries_[first].previous != kNone && label(entries_[first].previous) >= low) {
            first = entries_[first].previous;
            ++count;
        }
        while (entries_[last].next != kNone && label(entries_[last].next) - low < width) {
            last = entries_[last].next;
            ++count;
        }
        if (static_cast<double>(count) > roomIn(level)) continue;
        const std::uint64_t step = std::min(width / count, kStride);
        std::uint64_t next = low;
        for (std::uint32_t at = first;; at = entries_[at].next) {
            entries_[at].label = next;
            next += step;
            if (at == last) return;
        }
    }
    TESSERA_CHECK(false, "no labels are left for the places of a scene");
}

}  // namespace tessera
