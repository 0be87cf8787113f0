#include "server/import/reader/TexelLayout.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "server/import/reader/HalvedRows.h"
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
                              HalvedRows& to) {
    std::array<std::byte, 4 * 12 * 12> texels{};
    Bytes strip(4 * width * layout.blockHeightPx);
    const std::byte *block = from.data(), *last = nullptr;
    for (std::size_t top = 0; top < height; top += layout.blockHeightPx) {
        const std::size_t rows = std::min(layout.blockHeightPx, height - top);
        for (std::size_t left = 0; left < width; left += layout.blockWidthPx, block += layout.bytes) {
            // Plain pictures are one block again and again.
            if (last == nullptr || std::memcmp(block, last, layout.bytes) != 0)
                if (const std::string_view why = layout.decode(block, texels.data()); !why.empty()) return why;
            last = block;
            // What lies beyond the last column or row is nobody's.
            const std::size_t columns = std::min(layout.blockWidthPx, width - left);
            for (std::size_t y = 0; y < rows; ++y)
                std::memcpy(&strip[4 * (y * width + left)], &texels[4 * y * layout.blockWidthPx], 4 * columns);
        }
        for (std::size_t y = 0; y < rows; ++y) to.add(&strip[4 * y * width]);
    }
    return {};
}

/// A slice of texels, one after the other.
void convertRows(ByteSpan from, const TexelLayout& layout, std::size_t width, std::size_t height, HalvedRows& to) {
    Bytes row(4 * width);
    for (std::size_t y = 0; y < height; ++y) {
        convert(from.subspan(y * width * layout.bytes, width * layout.bytes), layout, row.data());
        to.add(row.data());
    }
}

/// The largest of the file's levels that has no side above that, or its smallest. Of a solid the first: its depth stays
/// when it is halved.
std::uint64_t levelWithin(const TextureFile& file, int maxSidePx) {
    std::uint64_t level = 0;
    while (file.depthPx == 1 && level + 1 < file.mipmaps &&
           std::max(halved(file.widthPx, level), halved(file.heightPx, level)) >
               static_cast<std::uint64_t>(std::max(maxSidePx, 1)))
        ++level;
    return level;
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

Expected<DecodedImage> decodeTexture(const TextureFile& file, const PictureBounds& bounds) {
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
    const std::uint64_t first = blocks ? 0 : levelWithin(file, bounds.maxSidePx), faces = cube ? 6 : 1,
                        end = blocks ? std::max<std::uint64_t>(1, file.mipmaps) : first + 1;
    std::uint64_t total = 0;
    for (std::uint64_t level = first; level < end; ++level) total += file.partBytes(level) * faces;
    const std::uint64_t width = halved(file.widthPx, first), height = halved(file.heightPx, first),
                        pixels = width * height * file.depthPx * faces;
    if (total > kMostBytes || (!blocks && 4 * pixels > kMostBytes))
        return fail(ErrorCode::kLimit, fmt::format("{} of {} MiB: up to {} can be read", file.kind,
                                                   std::max(total, blocks ? 0 : 4 * pixels) >> 20, kMostBytes >> 20));
    // Blocks that stay are twice there for a while; of floats each takes its time.
    const std::uint64_t cost = blocks ? total / 2 : pixels * (file.layout.floats > 0 ? 2 : 1);
    if (Expected<void> taken = bounds.pool.take(
            fmt::format("{} of {} × {} pixels{}", file.kind, file.widthPx, file.heightPx,
                        faces * file.depthPx > 1 ? fmt::format(", {} times", faces * file.depthPx) : ""),
            cost);
        !taken)
        return tl::unexpected(taken.error());
    const int halvings = blocks ? 0 : halvingsOf(width, height, bounds.maxSidePx);
    const std::uint64_t shownWidth = halvedSide(width, halvings), shownHeight = halvedSide(height, halvings);
    DecodedImage image{.widthPx = static_cast<int>(shownWidth),
                       .heightPx = static_cast<int>(shownHeight),
                       .encoding = file.layout.encoding,
                       .shape = file.shape};
    image.depthPx = solid ? static_cast<int>(file.depthPx) : 1;
    image.mipmaps = static_cast<int>(end - first);
    image.halved = first > 0 || halvings > 0;
    for (std::uint64_t level = first; level < end; ++level)
        for (std::uint64_t face = 0; face < faces; ++face) {
            const Expected<ByteSpan> part = file.part(level, face, file.partBytes(level));
            if (!part) return tl::unexpected(part.error());
            if (image.rgba.empty())
                image.rgba.reserve(blocks ? total : 4 * shownWidth * shownHeight * faces * file.depthPx);
            if (blocks) {
                image.rgba.insert(image.rgba.end(), part->begin(), part->end());
                continue;
            }
            const std::size_t slice = part->size() / file.depthPx;
            for (std::uint64_t z = 0; z < file.depthPx; ++z) {
                const std::size_t at = image.rgba.size();
                image.rgba.resize(at + 4 * shownWidth * shownHeight);
                HalvedRows rows(width, height, halvings, file.layout.encoding == ImageMessage::RGBE,
                                image.rgba.data() + at);
                const ByteSpan texels = part->subspan(z * slice, slice);
                if (!file.layout.decode) {
                    convertRows(texels, file.layout, width, height, rows);
                } else if (const std::string_view why = decodeBlocks(texels, file.layout, width, height, rows);
                           !why.empty()) {
                    return bad(std::string(why));
                }
            }
        }
    if (!file.fromTop) turnRows(image);
    return image;
}

}  // namespace tessera
