/// What projectors and monitors get, as pictures.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "common/wall/Wall.h"
#include "deploy/wall/Console.h"
#include "deploy/wall/TileImages.h"

namespace tessera {

/// What a tile showed last, or nothing.
using LastImageOf = std::function<const std::optional<TileImages::Image>&(const std::string& tile)>;

/// Removes the pictures of an earlier run from `folder`, whatever wall that showed; other files stay.
[[nodiscard]] Expected<void> clearOutputImages(const std::string& folder);

/// Writes `folder`/TILE.png for each output of the wall, named by its tile (by the left eye's, where it takes both):
/// packed, warped, blended, coloured, with the bytes that its window shows. An output whose tiles have no picture, or
/// not of one frame, is left out and named.
[[nodiscard]] Expected<void> writeOutputImages(const std::string& folder, const Wall& wall, const LastImageOf& imageOf,
                                               Console& console);

}  // namespace tessera
