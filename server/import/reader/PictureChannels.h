/// Channels of several pictures joined to one, as formats have a picture each for what is one picture here.
#pragma once

#include <vector>

#include "server/import/reader/ImageDecoder.h"

namespace tessera {

struct PictureChannel {
    DecodedImage picture;
    int from = 0, to = 0;  ///< 0 to 3: red, green, blue, alpha
};

/// As large as the largest of them, white where none is. kBadInput: one is made of blocks, or is no flat picture of
/// bytes.
[[nodiscard]] Expected<DecodedImage> joinedChannels(std::vector<PictureChannel> channels);

}  // namespace tessera
