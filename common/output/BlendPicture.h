/// Pictures that say how much of its light each pixel of an output keeps.
#pragma once

#include "common/base/Error.h"
#include "common/wall/Output.h"

namespace tessera {

struct BlendPicture {
    int widthPx = 0, heightPx = 0;
    std::vector<std::uint16_t> values;  ///< 65535 is 1; rows from the top

    /// The value at a place, 0 to 1 from the left and the upper edge; bilinear between the pixels' centres.
    [[nodiscard]] double at(double u, double v) const;
};

/// A PNG of 8 or 16 bits (or fewer), grey; of a coloured one the green channel. At most 16384 pixels each way and 2^26
/// in all; memory grows with the rows that are there. Never crashes whatever the bytes are. kBadInput says what is
/// wrong.
[[nodiscard]] Expected<BlendPicture> decodeBlendPicture(ByteSpan png);
/// 16 bits of grey.
[[nodiscard]] Bytes encodeBlendPicture(const BlendPicture& picture);

}  // namespace tessera
