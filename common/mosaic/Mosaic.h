/// Tile images put together to the picture of the whole wall.
#pragma once

#include <functional>
#include <vector>

#include "common/image/Picture.h"
#include "common/request/ViewRequests.h"
#include "common/wall/Wall.h"

namespace tessera {

struct Mosaic {
    Picture picture;  ///< visible pixels without gaps; several screens side by side, bottoms aligned, in the wall's
                      ///< order; shrunk where it is too large (PictureSheet)
    FrameNumber frame;
    std::vector<std::string> missing;  ///< tiles that are black because nobody draws them now
};

/// One eye: the centre's where a tile has it, else the left one. kRefused when the tiles are of different frames: ask
/// again. kBadInput: an image that is no PNG or of the wrong size.
[[nodiscard]] Expected<Mosaic> stitch(const Wall& wall, const answer::Images& images);
/// The same as a PNG of every pixel, however large: never shrunk, with memory for a row of each tile. `sink` is given
/// the file piece by piece; after an error it is of no use.
[[nodiscard]] Expected<void> stitchWhole(const Wall& wall, const answer::Images& images,
                                         const std::function<void(ByteSpan)>& sink);

}  // namespace tessera
