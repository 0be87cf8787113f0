#include "server/import/reader/HalvedRows.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "server/import/reader/RadiancePicture.h"

namespace tessera {
namespace {

void averageRows(const std::byte* above, const std::byte* below, std::size_t width, bool rgbe, std::byte* to) {
    const std::size_t half = std::max<std::size_t>(1, width / 2), right = width > 1 ? 4 : 0;
    for (std::size_t x = 0; x < half; ++x, to += 4) {
        const std::array<const std::byte*, 4> texels = {above + 8 * x, above + 8 * x + right, below + 8 * x,
                                                        below + 8 * x + right};
        if (rgbe) {
            // Of exponents there is no mean: that of what they say.
            double sum[3] = {};
            for (const std::byte* texel : texels) {
                double rgb[3];
                rgbeToLinear(texel, rgb);
                for (int c = 0; c < 3; ++c) sum[c] += 0.25 * rgb[c];
            }
            linearToRgbe(sum, to);
            continue;
        }
        for (std::size_t c = 0; c < 4; ++c) {
            unsigned sum = 2;
            for (const std::byte* texel : texels) sum += std::to_integer<unsigned>(texel[c]);
            to[c] = static_cast<std::byte>(sum / 4);
        }
    }
}

}  // namespace

int halvingsOf(std::size_t widthPx, std::size_t heightPx, int maxSidePx) {
    int halvings = 0;
    while (std::max(widthPx, heightPx) >> halvings > static_cast<std::size_t>(std::max(maxSidePx, 1))) ++halvings;
    return halvings;
}

std::size_t halvedSide(std::size_t px, int halvings) {
    return std::max<std::size_t>(1, px >> halvings);
}

HalvedRows::HalvedRows(std::size_t widthPx, std::size_t heightPx, int halvings, bool rgbe, std::byte* to)
    : rowBytes_(4 * halvedSide(widthPx, halvings)), rgbe_(rgbe), to_(to) {
    for (int i = 0; i < halvings; ++i) {
        const std::size_t width = halvedSide(widthPx, i), height = halvedSide(heightPx, i);
        levels_.push_back({width, height, 0, Bytes(4 * width), Bytes(4 * halvedSide(width, 1))});
    }
}

void HalvedRows::add(std::size_t number, const std::byte* row) {
    if (number == levels_.size()) {
        std::memcpy(to_, row, rowBytes_);
        to_ += rowBytes_;
        return;
    }
    Level& level = levels_[number];
    const bool isFirst = level.rows++ % 2 == 0;
    if (isFirst && level.height > 1) {
        std::memcpy(level.above.data(), row, level.above.size());
        return;
    }
    averageRows(isFirst ? row : level.above.data(), row, level.width, rgbe_, level.made.data());
    add(number + 1, level.made.data());
}

}  // namespace tessera
