#include "common/export/LeavingPictures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "common/drawable/ImageLayout.h"
#include "common/image/Picture.h"
#include "common/math/Srgb.h"

namespace tessera {
namespace {

std::vector<std::uint8_t> tinted(std::span<const std::uint8_t> rgba, const Vec4f& tint) {
    std::array<std::array<std::uint8_t, 256>, 4> tables{};
    for (std::size_t k = 0; k < 4; ++k)
        for (std::size_t i = 0; i < 256; ++i) {
            const float value = static_cast<float>(i) / 255, share = tint[static_cast<int>(k)];
            const float made = k == 3 ? value * share : srgbOfLinear(linearOfSrgb(value) * share);
            // What has no tint stays to the last bit, so that the next round is the same.
            tables[k][i] = static_cast<std::uint8_t>(share == 1 ? static_cast<long>(i)
                                                                : std::lround(255 * std::clamp(made, 0.0f, 1.0f)));
        }
    std::vector<std::uint8_t> made(rgba.size());
    for (std::size_t i = 0; i < rgba.size(); ++i) made[i] = tables[i % 4][rgba[i]];
    return made;
}

}  // namespace

std::optional<Bytes> pngOf(const Image& image, ExportNotes& notes, ObjectId node, const Vec4f& tint) {
    if (image.encoding != Image::kSrgb || image.shape != Image::kFlat) {
        notes.add(image.shape != Image::kFlat      ? "images of other shapes than flat ones are left out"
                  : image.encoding == Image::kRgbe ? "images with a wide range of light are left out"
                                                   : "images in compressed blocks are left out",
                  node);
        return std::nullopt;
    }
    constexpr std::int64_t kWidestPx = PictureSheet::kMaxSidePx;
    if (image.pixels.sizeBytes() == 0 || !image.pixels.resident() || !checkImage(image) || image.widthPx > kWidestPx ||
        image.heightPx > kWidestPx) {
        notes.add("images that are not whole, or have more than 16384 pixels a side, are left out", node);
        return std::nullopt;
    }
    const std::span<const std::uint8_t> rgba = image.pixels.as<std::uint8_t>();
    const int width = static_cast<int>(image.widthPx), height = static_cast<int>(image.heightPx);
    return tint == Vec4f::Ones() ? encodePng(width, height, rgba) : encodePng(width, height, tinted(rgba, tint));
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
