#include "server/import/reader/TexelLayout.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "server/import/reader/RadiancePicture.h"
#include "server/import/reader/blocks/AstcBlock.h"

namespace tessera {
namespace {

using ImageMessage = proto::scene::Image;

/// What is decoded of one file; the importer's own bounds are for all of a scene.
constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 30;

std::uint64_t halved(std::uint64_t px, std::uint64_t times) {
    return std::max<std::uint64_t>(1, times < 64 ? px >> times : 0);
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
                const unsigned channel = layout.floats == 1 ? 0 : c;
                const double value =
                    channel < layout.floats ? floatOf(at + channel * layout.floatBits / 8, layout.floatBits) : 0;
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

/// A slice of blocks that become texels. Empty, or why the file is not read.
std::string_view decodeBlocks(ByteSpan from, const TexelLayout& layout, std::size_t width, std::size_t height,
                              std::byte* to) {
    std::array<std::byte, 4 * 12 * 12> texels{};
    const std::byte* block = from.data();
    for (std::size_t top = 0; top < height; top += layout.blockHeightPx)
        for (std::size_t left = 0; left < width; left += layout.blockWidthPx, block += layout.bytes) {
            if (const std::string_view why = layout.decode(block, texels.data()); !why.empty()) return why;
            // What lies beyond the last column or row is nobody's.
            const std::size_t columns = std::min(layout.blockWidthPx, width - left),
                              rows = std::min(layout.blockHeightPx, height - top);
            for (std::size_t y = 0; y < rows; ++y)
                std::memcpy(to + 4 * ((top + y) * width + left), &texels[4 * y * layout.blockWidthPx], 4 * columns);
        }
    return {};
}

void turnRows(DecodedImage& image) {
    const std::size_t row = static_cast<std::size_t>(image.widthPx) * 4,
                      rows = static_cast<std::size_t>(image.heightPx);
    for (std::size_t from = 0; from < image.rgba.size(); from += row * rows)
        for (std::size_t y = 0; y < rows / 2; ++y)
            std::swap_ranges(image.rgba.begin() + static_cast<std::ptrdiff_t>(from + y * row),
                             image.rgba.begin() + static_cast<std::ptrdiff_t>(from + (y + 1) * row),
                             image.rgba.begin() + static_cast<std::ptrdiff_t>(from + (rows - 1 - y) * row));
}

}  // namespace

TexelLayout TexelLayout::blocks(Encoding encoding) {
    return {.encoding = encoding,
            .bytes = encoding == ImageMessage::BC1 || encoding == ImageMessage::BC4 ? std::size_t{8} : std::size_t{16},
            .blockWidthPx = 4,
            .blockHeightPx = 4};
}

TexelLayout TexelLayout::etc(EtcFormat format) {
    return {.bytes = etcBlockBytes(format),
            .blockWidthPx = 4,
            .blockHeightPx = 4,
            .decode = [format](const std::byte* block, std::byte* rgba) {
                decodeEtcBlock(format, block, rgba);
                return std::string_view();
            }};
}

TexelLayout TexelLayout::astc(std::size_t size, bool srgb) {
    const auto [width, height] = kAstcSizes[size];
    const AstcDecoder decoder(width, height, srgb ? AstcDecoder::Colours::kSrgb : AstcDecoder::Colours::kLinear);
    return {.bytes = AstcDecoder::kBytes,
            .blockWidthPx = width,
            .blockHeightPx = height,
            // A block that is none shows the specification's magenta.
            .decode = [decoder](const std::byte* block, std::byte* rgba) {
                return decoder.decode(block, rgba) == AstcDecoder::Kind::kHdr
                           ? std::string_view(
                                 "of ASTC with a wide range of light (HDR), which is not read: .exr and "
                                 ".hdr pictures are")
                           : std::string_view();
            }};
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

std::uint64_t TextureFile::partBytes(std::uint64_t level) const {
    const auto units = [level](std::uint64_t px, std::uint64_t unit) { return (halved(px, level) + unit - 1) / unit; };
    return units(widthPx, layout.blockWidthPx) * units(heightPx, layout.blockHeightPx) * layout.bytes *
           halved(depthPx, level);
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
    if (blocks && !file.fromTop) return bad("of blocks whose rows go upwards, which is not read");
    const auto most = static_cast<std::uint64_t>(std::bit_width(std::max({file.widthPx, file.heightPx, file.depthPx})));
    if (file.mipmaps > most) return bad(fmt::format("has {} mipmaps, of {} that its size has", file.mipmaps, most));
    // Of others they are made where they are drawn.
    const std::uint64_t levels = blocks ? std::max<std::uint64_t>(1, file.mipmaps) : 1, faces = cube ? 6 : 1;
    std::uint64_t total = 0;
    for (std::uint64_t level = 0; level < levels; ++level) total += file.partBytes(level) * faces;
    const std::uint64_t pixels = file.widthPx * file.heightPx * file.depthPx * faces;
    if (total > kMostBytes || (!blocks && 4 * pixels > kMostBytes))
        return fail(ErrorCode::kLimit, fmt::format("{} of {} MiB: up to {} can be read", file.kind,
                                                   std::max(total, blocks ? 0 : 4 * pixels) >> 20, kMostBytes >> 20));
    DecodedImage image{.widthPx = static_cast<int>(file.widthPx),
                       .heightPx = static_cast<int>(file.heightPx),
                       .encoding = file.layout.encoding,
                       .shape = file.shape};
    image.depthPx = solid ? static_cast<int>(file.depthPx) : 1;
    image.mipmaps = static_cast<int>(levels);
    for (std::uint64_t level = 0; level < levels; ++level)
        for (std::uint64_t face = 0; face < faces; ++face) {
            const Expected<ByteSpan> part = file.part(level, face, file.partBytes(level));
            if (!part) return tl::unexpected(part.error());
            const std::size_t at = image.rgba.size();
            if (blocks) {
                image.rgba.insert(image.rgba.end(), part->begin(), part->end());
                continue;
            }
            image.rgba.resize(at + 4 * pixels / faces);
            if (!file.layout.decode) {
                convert(*part, file.layout, image.rgba.data() + at);
                continue;
            }
            const std::size_t slice = part->size() / file.depthPx;
            for (std::uint64_t z = 0; z < file.depthPx; ++z)
                if (const std::string_view why =
                        decodeBlocks(part->subspan(z * slice, slice), file.layout, file.widthPx, file.heightPx,
                                     image.rgba.data() + at + z * 4 * file.widthPx * file.heightPx);
                    !why.empty())
                    return bad(std::string(why));
        }
    if (!file.fromTop) turnRows(image);
    return image;
}

}  // namespace tessera
