/// In which order what is solid is drawn.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace tessera {

/// Each is one order for all tiles and cullers of a screen: what it looks at is the scene's and the screen's camera's
/// alone, and ends with the node's id. So ties of depth are won by the same item everywhere; which item that is may
/// differ between sortings. A state is what a renderer has to be told before it can draw: primitive, images, sides,
/// material, mesh.
enum class DrawSorting : std::uint8_t {
    kDepth,  ///< front to back, by the middles of boxes: what is hidden is rejected
    kState,  ///< by state, front to back within one: neighbours that share mesh and state are one call
    kBoth,   ///< by bands of depth, half an octave each, and by state within one
};
inline constexpr std::array<DrawSorting, 3> kAllDrawSortings = {DrawSorting::kDepth, DrawSorting::kState,
                                                                DrawSorting::kBoth};

[[nodiscard]] std::string_view nameOf(DrawSorting sorting);  ///< "depth", "state", "both"

/// The band of depth, for `kBoth`: grows with the depth; one band for what is not before the eye. The same bits on
/// every processor.
[[nodiscard]] std::int32_t depthBand(double depth);

}  // namespace tessera
