#include "common/wall/LightHistogram.h"

#include <algorithm>
#include <cmath>

namespace tessera {

std::vector<PixelRect> countedElsewhere(std::span<const Tile> tiles, const Tile& tile) {
    std::vector<PixelRect> before;
    for (const Tile& other : tiles) {
        if (other.name == tile.name) break;
        const PixelRect &a = other.rect, &b = tile.rect;
        const bool overlap = a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;
        if (overlap && other.screen == tile.screen && other.eye == tile.eye && other.user == tile.user)
            before.push_back(a);
    }
    return before;
}

std::optional<double> exposureFor(std::span<const std::uint64_t, LightHistogram::kClasses> pixels) {
    constexpr std::uint64_t kBrightest = 50;  // one of so many
    constexpr double kDarkFrom = 4, kDarkTo = 8;
    std::uint64_t all = 0;
    for (std::size_t i = 1; i < pixels.size(); ++i) all += pixels[i];
    int brightest = LightHistogram::kClasses - 1;
    for (std::uint64_t above = 0; brightest > 1; --brightest) {
        above += pixels[static_cast<std::size_t>(brightest)];
        if (above > all / kBrightest) break;
    }
    // The first class is darkness itself.
    if (brightest <= 1) return std::nullopt;
    double sum = 0, count = 0;
    for (int i = 2; i <= brightest; ++i) {
        const double below = LightHistogram::stopsOf(brightest) - LightHistogram::stopsOf(i);
        const double weight = std::clamp((kDarkTo - below) / (kDarkTo - kDarkFrom), 0.0, 1.0) *
                              static_cast<double>(pixels[static_cast<std::size_t>(i)]);
        sum += weight * std::exp2(LightHistogram::stopsOf(i));
        count += weight;
    }
    return std::log2(kMiddle * count / sum);
}

}  // namespace tessera
