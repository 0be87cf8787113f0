#include "common/export/LeavingPictures.h"

#include <cmath>

#include "common/drawable/ImageLayout.h"
#include "common/image/Picture.h"

namespace tessera {

std::optional<Bytes> pngOf(const Image& image, ExportNotes& notes, ObjectId node) {
    if (image.encoding != Image::kSrgb || image.shape != Image::kFlat) {
        notes.add(image.shape != Image::kFlat      ? "images of other shapes than flat ones are left out"
                  : image.encoding == Image::kRgbe ? "images with a wide range of light are left out"
                                                   : "images in compressed blocks are left out",
                  node);
        return std::nullopt;
    }
    constexpr std::int64_t kWidestPx = PictureSheet::kMaxSidePx;
    if (!image.pixels.resident() || !checkImage(image) || image.widthPx > kWidestPx || image.heightPx > kWidestPx) {
        notes.add("images that are not whole, or have more than 16384 pixels a side, are left out", node);
        return std::nullopt;
    }
    return encodePng(static_cast<int>(image.widthPx), static_cast<int>(image.heightPx),
                     image.pixels.as<std::uint8_t>());
}

bool isPlaced(const Image& image) {
    return image.offset != Vec2f::Zero() || image.scale != Vec2f::Ones() || image.rotation != 0;
}

Vec2f placedTexcoord(const Image& image, const Vec2f& uv) {
    const float c = std::cos(image.rotation), s = std::sin(image.rotation);
    const Vec2f scaled = uv.cwiseProduct(image.scale);
    return {c * scaled[0] + s * scaled[1] + image.offset[0], c * scaled[1] - s * scaled[0] + image.offset[1]};
}

}  // namespace tessera
