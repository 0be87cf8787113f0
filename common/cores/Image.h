/// Pixels.
#pragma once

#include "common/field/Field.h"

namespace tessera {

struct Image {
    static constexpr ObjectType kType{6};
    Blob pixels;  ///< uint8[4] RGBA per pixel, sRGB, rows from the top
    std::int64_t widthPx = 0;
    std::int64_t heightPx = 0;

    static constexpr double kMaxSidePx = 65536;
};
template <>
inline constexpr auto kDescription<Image> =
    describe("Image",
             field<&Image::pixels>(1, "pixels").affects(Effect::kLook),
             field<&Image::widthPx>(2, "widthPx").unit(Unit::kPixel).between(0, Image::kMaxSidePx).affects(Effect::kLook),
             field<&Image::heightPx>(3, "heightPx").unit(Unit::kPixel).between(0, Image::kMaxSidePx).affects(Effect::kLook))
        .notACore();

}  // namespace tessera
