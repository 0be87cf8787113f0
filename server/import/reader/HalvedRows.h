/// A picture that becomes half as large, or a quarter, … while its rows come: the whole need not be in memory.
#pragma once

#include <vector>

#include "common/base/Bytes.h"

namespace tessera {

/// How often the larger side is to be halved until it is at most that.
[[nodiscard]] int halvingsOf(std::size_t widthPx, std::size_t heightPx, int maxSidePx);
/// What is left of a side; 1 at least.
[[nodiscard]] std::size_t halvedSide(std::size_t px, int halvings);

/// Averages 2 × 2 pixels again and again, as `halve` (ImageDecoder.h) does; an odd last row or column is dropped.
class HalvedRows {
public:
    /// Pixels are four bytes each; `rgbe`: of a shared exponent. `to`: the place of the small picture.
    HalvedRows(std::size_t widthPx, std::size_t heightPx, int halvings, bool rgbe, std::byte* to);

    /// The next row, from the top.
    void add(const std::byte* row) { add(0, row); }

private:
    struct Level {
        std::size_t width = 0, height = 0;
        std::size_t rows = 0;  ///< that have come
        Bytes above;           ///< the one that waits for its neighbour
        Bytes made;            ///< of both
    };
    void add(std::size_t level, const std::byte* row);

    std::vector<Level> levels_;  ///< that are halved
    std::size_t rowBytes_;
    bool rgbe_;
    std::byte* to_;
};

}  // namespace tessera
