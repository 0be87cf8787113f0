/// Which triangles are seen through which texels, and what of them. For this folder only.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/math/Types.h"

namespace tessera {

class Workers;

namespace spherical {

/// Axes of a face of the cube (FieldTypes.h).
struct CubeFace {
    unsigned c, a, b;
    float sign;
};
[[nodiscard]] inline CubeFace cubeFace(unsigned face) {
    const unsigned c = face >> 1;
    return {c, (c + 1) % 3, (c + 2) % 3, (face & 1U) != 0 ? -1.0F : 1.0F};
}

using Corners = std::array<Vec3f, 3>;

/// A triangle, or what of it is in a texel's pyramid, for it.
struct RasterEntry {
    static constexpr std::uint32_t kWhole = 0xffffffffU;
    std::uint32_t texel;           ///< face · 4^level + place
    std::uint32_t triangle;        ///< a place in the list given
    std::uint32_t first = kWhole;  ///< of its clipped corners; kWhole: the triangle sticks out by less than a texel
    std::uint32_t count = 3;
};

struct Raster {
    unsigned level = 0;
    std::vector<RasterEntry> entries;  ///< by texel; within a texel by triangle
    std::vector<std::uint32_t> start;  ///< per texel, and one more
    std::vector<Vec3f> clipped;
};

/// Coordinates about the centre. Every point of every triangle is in the pyramid of a texel that has an entry of the
/// triangle, and, where that is clipped, in the hull of its corners; both to within 2e-6 of the texel's place. The
/// level falls from the one given until there are at most twelve entries per triangle (and 4096); level 0 needs six.
/// The same for any number of threads. A clip that goes through the centre is not clipped there: it is seen everywhere.
[[nodiscard]] Raster rasterise(std::span<const Corners> triangles, unsigned level, Workers* workers);

}  // namespace spherical
}  // namespace tessera
