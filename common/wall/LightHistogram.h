/// How bright a wall's picture of a scene is, before exposure and tone map: what exposures are metered from.
///
/// Whole numbers, added up: the same for any division of the wall into tiles, tiles into parts, and in any order.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/wall/Wall.h"

namespace tessera {

/// One pixel of each square of 8×8 pixels of a screen is looked at. It counts once for each eye and user, whichever of
/// the tiles that overlap there shows it; what is hidden behind bezels does not count.
struct LightHistogram {
    /// Class 0: not measured, as nothing is there, or something that shows its own colour whatever shines on it. Class
    /// n: luminance (ITU-R BT.709) from kLeastStops + (n - 1) / kClassesPerStop stops on, 0 being radiance 1; less is
    /// in the first class, more in the last.
    static constexpr int kClasses = 256, kClassesPerStop = 8, kLeastStops = -13;
    static constexpr int kSquarePx = 8, kPlaceInSquare = 4;  ///< the pixel (4, 4) of each
    std::array<std::uint32_t, kClasses> pixels{};
    bool operator==(const LightHistogram&) const = default;

    LightHistogram& operator+=(const LightHistogram& other) {
        for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] += other.pixels[i];
        return *this;
    }
    friend LightHistogram operator+(LightHistogram a, const LightHistogram& b) { return a += b; }

    /// The middle of a class above 0.
    [[nodiscard]] static constexpr double stopsOf(int of) { return kLeastStops + (of - 0.5) / kClassesPerStop; }

    /// The first square whose looked at pixel lies at or beyond `px`, along one axis.
    [[nodiscard]] static constexpr int squareFrom(int px) {
        return px <= kPlaceInSquare ? 0 : (px - kPlaceInSquare + kSquarePx - 1) / kSquarePx;
    }
};

/// Where other tiles of the same screen, eye and user come before this one in `tiles`, all of the wall's: what they
/// show is theirs to count. They may overlap each other.
[[nodiscard]] std::vector<PixelRect> countedElsewhere(std::span<const Tile> tiles, const Tile& tile);

/// The exposure, in stops, at which a picture of such light looks right; nothing where it shows none.
///
/// A camera's: the mean of what is lit becomes `kMiddle`, which is what it is in the median of the shipped scenes: made
/// for no exposure, they need none. The brightest fiftieth does not count, which is lamps and glints; nor, ever less
/// from 4 to 8 stops below it, what lies in the dark.
inline constexpr double kMiddle = 0.23;
[[nodiscard]] std::optional<double> exposureFor(std::span<const std::uint64_t, LightHistogram::kClasses> pixels);

}  // namespace tessera
