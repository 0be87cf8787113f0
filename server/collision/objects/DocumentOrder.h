/// Which of two places comes first in the document, and which holds which.
#pragma once

#include <cstdint>
#include <vector>

namespace tessera {

/// A tree as a row of brackets: each place opens before and closes after all that is below it. Brackets are numbered
/// by place and linked, and each carries a label that grows along the row, so that order and "below" are comparisons
/// of two numbers; where no label is left between two brackets their neighbours are spread out anew, amortised
/// O(log n) per insertion (Bender et al., Two simplified algorithms for maintaining order in a list, ESA 2002).
class DocumentOrder {
public:
    static constexpr std::uint32_t kNone = 0xffffffffu;
    [[nodiscard]] static constexpr std::uint32_t open(std::uint32_t place) { return 2 * place; }
    [[nodiscard]] static constexpr std::uint32_t close(std::uint32_t place) { return 2 * place + 1; }
    [[nodiscard]] static constexpr std::uint32_t placeOf(std::uint32_t bracket) { return bracket / 2; }
    [[nodiscard]] static constexpr bool opens(std::uint32_t bracket) { return bracket % 2 == 0; }

    void clear() { entries_.clear(); }
    /// Puts a place with nothing below it right after a bracket; kNone: a row of its own.
    void insert(std::uint32_t place, std::uint32_t after);
    /// Takes a place and all below it out, as a row of its own.
    void cut(std::uint32_t place);
    /// Puts what was cut back, right after a bracket of another row. Costs what it holds.
    void paste(std::uint32_t place, std::uint32_t after);

    [[nodiscard]] std::uint32_t next(std::uint32_t bracket) const { return entries_[bracket].next; }
    [[nodiscard]] std::uint32_t previous(std::uint32_t bracket) const { return entries_[bracket].previous; }
    /// Of two places of one row.
    [[nodiscard]] bool before(std::uint32_t a, std::uint32_t b) const { return label(open(a)) < label(open(b)); }
    /// Grows along the row. Another one after every change of the order.
    [[nodiscard]] std::uint64_t rank(std::uint32_t place) const { return label(open(place)); }
    /// Whether a place is the other or stands above it.
    [[nodiscard]] bool holds(std::uint32_t above, std::uint32_t place) const {
        return label(open(above)) <= label(open(place)) && label(open(place)) < label(close(above));
    }

private:
    struct Entry {
        std::uint64_t label = 0;
        std::uint32_t previous = kNone, next = kNone;
    };
    [[nodiscard]] std::uint64_t label(std::uint32_t bracket) const { return entries_[bracket].label; }
    void link(std::uint32_t first, std::uint32_t last, std::uint32_t after, std::size_t count);
    void spreadOut(std::uint32_t first, std::uint32_t last, std::size_t count);

    std::vector<Entry> entries_;
};

}  // namespace tessera
