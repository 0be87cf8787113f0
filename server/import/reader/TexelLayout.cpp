#include "server/import/reader/TexelLayout.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "server/import/reader/RadiancePicture.h"

namespace tessera {
namespace {

using ImageMessage = proto::scene::Image;

/// What is decoded of one file; the importer's own bounds are for all of a scene.
constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 30;

std::uint64_t halved(std::uint64_t px, std::uint64_t times) {
    return std::max<std::uint64_t>(1, times < 64 ? px >> times : 0);
}

std::uint64_t sliceBytes(const TextureFile& file, std::uint64_t level) {
    const bool blocks = file.layout.encoding >= ImageMessage::BC1;
    const auto across = [&](std::uint64_t px) { return blocks ? (halved(px, level) + 3) / 4 : halved(px, level); };
    return across(file.widthPx) * across(file.heightPx) * file.layout.bytes;
}

double floatOf(const std::byte* at, unsigned bits) {
    if (bits == 32) {
        float value = 0;
        std::memcpy(&value, at, 4);
        return value;
    }
    std::uint16_t half = 0;
    std::memcpy(&half, at, 2);
    const int exponent = half >> 10 & 31, fraction = half & 1023;
    const double size = exponent == 31  ? (fraction == 0 ? HUGE_VAL : std::nan(""))
                        : exponent == 0 ? std::ldexp(fraction, -24)
                                        : std::ldexp(1024 + fraction, exponent - 25);
    return half & 0x8000 ? -size : size;
}

std::byte eightBitsOf(std::uint64_t texel, std::uint64_t mask) {
    const int shift = std::countr_zero(mask);
    const std::uint64_t most = mask >> shift;
    return static_cast<std::byte>(((texel & mask) >> shift) * 255.0 / static_cast<double>(most) + 0.5);
}

void convert(ByteSpan from, const TexelLayout& layout, std::byte* to) {
    const std::size_t count = from.size() / layout.bytes;
    for (std::size_t i = 0; i < count; ++i, to += 4) {
        const std::byte* at = from.data() + i * layout.bytes;
        if (layout.floats > 0) {
            double rgb[3];
            for (unsigned c = 0; c < 3; ++c) {
                const double value =
                    floatOf(at + std::min(c, layout.floats - 1) * layout.floatBits / 8, layout.floatBits);
                rgb[c] = value > 0 ? std::min(value, 1e30) : 0;  // not of what is no number
            }
            linearToRgbe(rgb, to);
            continue;
        }
        std::uint64_t texel = 0;
        std::memcpy(&texel, at, layout.bytes);
        for (std::size_t c = 0; c < 4; ++c) {
            const std::uint64_t mask = layout.masks[layout.grey && c < 3 ? 0 : c];
            to[c] = mask != 0 ? eightBitsOf(texel, mask) : c == 3 ? std::byte{255} : std::byte{0};
        }
    }
}

}  // namespace

TexelLayout TexelLayout::blocks(Encoding encoding) {
    return {.encoding = encoding,
            .bytes = encoding == ImageMessage::BC1 || encoding == ImageMessage::BC4 ? std::size_t{8} : std::size_t{16}};
}

TexelLayout TexelLayout::bits(const std::string& order, const std::array<unsigned, 4>& widths) {
    TexelLayout layout;
    unsigned at = 0;
    for (std::size_t i = 0; i < order.size(); ++i) {
        const std::size_t channel = std::string_view("rgba").find(order[i]);
        if (channel != std::string_view::npos) layout.masks[channel] = ((std::uint64_t{1} << widths[i]) - 1) << at;
        at += widths[i];
    }
    layout.bytes = (at + 7) / 8;
    return layout;
}

TexelLayout TexelLayout::floating(unsigned bits, unsigned count) {
    return {.encoding = ImageMessage::RGBE, .bytes = std::size_t{bits / 8} * count, .floatBits = bits, .floats = count};
}

Expected<DecodedImage> decodeTexture(const TextureFile& file) {
    const auto bad = [&file](std::string why) {
        return fail(ErrorCode::kBadInput, fmt::format("{} {}", file.kind, std::move(why)));
    };
    constexpr std::uint64_t kMostSide = 16384, kMostDepth = 2048;
    const bool solid = file.shape == ImageMessage::SOLID, cube = file.shape == ImageMessage::CUBE;
    if (file.widthPx == 0 || file.heightPx == 0 || file.depthPx == 0 || file.widthPx > kMostSide ||
        file.heightPx > kMostSide || file.depthPx > kMostDepth ||
        (solid && std::max(file.widthPx, file.heightPx) > kMostDepth))
        return bad(fmt::format("of {} × {} × {} pixels: 1 to {} a side can be read, of solids to {}", file.widthPx,
                               file.heightPx, file.depthPx, kMostSide, kMostDepth));
    if (cube && file.widthPx != file.heightPx)
        return bad(fmt::format("is a cube of {} × {} pixels", file.widthPx, file.heightPx));
    if (solid && file.layout.encoding == ImageMessage::RGBE)
        return bad("is a solid of floats, which are for surroundings");
    const bool blocks = file.layout.encoding >= ImageMessage::BC1;
    const auto most = static_cast<std::uint64_t>(std::bit_width(std::max({file.widthPx, file.heightPx, file.depthPx})));
    if (file.mipmaps > most) return bad(fmt::format("has {} mipmaps, of {} that its size has", file.mipmaps, most));
    // Of others they are made where they are drawn.
    const std::uint64_t levels = blocks ? std::max<std::uint64_t>(1, file.mipmaps) : 1, faces = cube ? 6 : 1;
    std::uint64_t total = 0;
    for (std::uint64_t level = 0; level < levels; ++level)
        total += sliceBytes(file, level) * halved(file.depthPx, level) * faces;
    if (total > kMostBytes || total / file.layout.bytes * (blocks ? 0 : 4) > kMostBytes)
        return fail(ErrorCode::kLimit,
                    fmt::format("{} of {} MiB: up to {} can be read", file.kind, total >> 20, kMostBytes >> 20));
    DecodedImage image{.widthPx = static_cast<int>(file.widthPx),
                       .heightPx = static_cast<int>(file.heightPx),
                       .encoding = file.layout.encoding,
                       .shape = file.shape};
    image.depthPx = solid ? static_cast<int>(file.depthPx) : 1;
    image.mipmaps = static_cast<int>(levels);
    for (std::uint64_t level = 0; level < levels; ++level)
        for (std::uint64_t face = 0; face < faces; ++face) {
            const Expected<ByteSpan> part =
                file.part(level, face, sliceBytes(file, level) * halved(file.depthPx, level));
            if (!part) return tl::unexpected(part.error());
            const std::size_t at = image.rgba.size();
            if (blocks) {
                image.rgba.insert(image.rgba.end(), part->begin(), part->end());
            } else {
                image.rgba.resize(at + part->size() / file.layout.bytes * 4);
                convert(*part, file.layout, image.rgba.data() + at);
            }
        }
    return image;
}

}  // namespace tessera
