/// Triangles in an order in which neighbours in the array are neighbours in space.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace tessera {

/// The same triangles along a Z-order curve (G. M. Morton 1966) through their centroids: whoever cuts the array into
/// runs gets compact pieces. Of equal places the earlier first, so that it depends on nothing but the arrays. Positions
/// are xyz, finite; indices in range, a whole number of triangles.
[[nodiscard]] std::vector<std::uint32_t> inSpatialOrder(std::span<const float> positions,
                                                        std::span<const std::uint32_t> indices);

}  // namespace tessera
