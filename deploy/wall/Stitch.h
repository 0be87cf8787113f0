/// One picture of the whole wall from the tiles' images.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/base/Error.h"
#include "common/image/Picture.h"
#include "common/wall/PictureLayout.h"

namespace tessera {

/// Gives a tile's image, or nothing where there is none.
using TileSource = std::function<Expected<std::optional<Picture>>(const std::string& tile)>;

struct Stitched {
    Picture picture;
    std::vector<std::string> missing;  ///< tiles without an image: they are dark
};

/// Shrunk where it is too large (PictureSheet). kBadInput: an image that has not its tile's size.
[[nodiscard]] Expected<Stitched> stitch(const PictureLayout& layout, const TileSource& source);

}  // namespace tessera
