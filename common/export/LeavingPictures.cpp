#include "common/export/LeavingPictures.h"

#include <cmath>

#include "common/drawable/ImageLayout.h"
#include "common/image/Picture.h"
#include "common/math/Srgb.h"

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

Vec3f meanColor(const Image& image, bool linear) {
    if (image.encoding != Image::kSrgb || image.shape != Image::kFlat || !image.pixels.resident() || !checkImage(image))
        return Vec3f::Ones();
    const std::span<const std::uint8_t> bytes = image.pixels.as<std::uint8_t>();
    Vec3d sum = Vec3d::Zero();
    for (std::size_t i = 0; i + 4 <= bytes.size(); i += 4)
        for (int k = 0; k < 3; ++k) {
            const float value = static_cast<float>(bytes[i + static_cast<std::size_t>(k)]) / 255;
            sum[k] += linear ? linearOfSrgb(value) : value;
        }
    return bytes.size() < 4 ? Vec3f(Vec3f::Ones()) : Vec3f((sum / static_cast<double>(bytes.size() / 4)).cast<float>());
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
