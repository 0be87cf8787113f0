/// Polygons cut into triangles of their own corners.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/base/Error.h"

namespace tessera {

/// A place in the plane, in steps of a grid: whose side of a line something is on is exact.
struct GridPoint {
    static constexpr std::int64_t kMost = std::int64_t{1} << 30;  ///< from 0 to this, so that no area overflows
    std::int64_t x = 0, y = 0;
    bool operator==(const GridPoint&) const = default;
};

/// Three corner numbers per triangle, in the order in which the outline goes around: of n corners always n - 2
/// triangles, some of them without an area where corners repeat or the outline touches itself. They cover an outline
/// that does not cross itself exactly, holes that a cut leads to included; of one that does they are some triangles of
/// its corners. Ear clipping (G. H. Meisters, "Polygons have ears", 1975): ears are looked for by a tree over the
/// corners that turn inwards.
///
/// `steps` is what it may cost, in boxes and corners looked at, and is counted down; kLimit where there are none left.
/// A few hundred per corner are plenty of usual outlines.
[[nodiscard]] Expected<std::vector<std::uint32_t>> clipEars(std::span<const GridPoint> corners, std::uint64_t& steps);

}  // namespace tessera
