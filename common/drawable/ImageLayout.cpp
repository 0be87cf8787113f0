#include "common/drawable/ImageLayout.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>

#include "common/cores/Image.h"

namespace tessera {
namespace {

/// What GL takes of each kind everywhere; of solids the least that OpenGL 4.5 asks for.
constexpr std::int64_t kMostFlat = Image::kMaxSidePx, kMostSolid = 2048, kMostCube = 16384;

tl::unexpected<Error> misfit(std::string why) {
    return fail(ErrorCode::kBadInput, std::move(why));
}

std::uint64_t unitsAcross(std::int64_t px, bool compressed) {
    return static_cast<std::uint64_t>(compressed ? (px + 3) / 4 : px);
}

/// The colour of a bc1 block that has a transparent one: the first of its two ends is not the larger.
bool bc1LetsThrough(const std::byte* block) {
    const auto at = [block](std::size_t i) { return std::to_integer<unsigned>(block[i]); };
    if ((at(0) | at(1) << 8) > (at(2) | at(3) << 8)) return false;
    const std::uint32_t indices = at(4) | at(5) << 8 | at(6) << 16 | at(7) << 24;
    return (indices & indices >> 1 & 0x55555555u) != 0;  // any that is 3
}

/// Alpha of eight steps (bc3), as bc4 has it: of six steps 7 is 255 and 6 is 0.
bool bc3LetsThrough(const std::byte* block) {
    const auto first = std::to_integer<unsigned>(block[0]), second = std::to_integer<unsigned>(block[1]);
    if (first == 255 && second == 255) {
        // Six steps then: index 6 is 0 all the same.
        std::uint64_t indices = 0;
        for (std::size_t i = 0; i < 6; ++i) indices |= std::to_integer<std::uint64_t>(block[2 + i]) << 8 * i;
        for (int i = 0; i < 16; ++i, indices >>= 3)
            if ((indices & 7) == 6) return true;
        return false;
    }
    std::uint64_t indices = 0;
    for (std::size_t i = 0; i < 6; ++i) indices |= std::to_integer<std::uint64_t>(block[2 + i]) << 8 * i;
    // The one end that is 255, or of six steps index 7.
    for (int i = 0; i < 16; ++i, indices >>= 3) {
        const unsigned index = indices & 7;
        const bool full =
            (index == 0 && first == 255) || (index == 1 && second == 255) || (index == 7 && first <= second);
        if (!full) return true;
    }
    return false;
}

/// Bits of a bc7 block, the lowest of the first byte first.
unsigned bitsOf(const std::byte* block, int first, int count) {
    unsigned value = 0;
    for (int i = 0; i < count; ++i)
        value |= (std::to_integer<unsigned>(block[(first + i) / 8]) >> (first + i) % 8 & 1u) << i;
    return value;
}

/// Modes 0 to 3 have no alpha; of the others the ends that alpha is made of are all full, or it lets through (Khronos
/// Data Format 1.3, section 20.1).
bool bc7LetsThrough(const std::byte* block) {
    const int mode = std::countr_zero(std::to_integer<unsigned>(block[0]) | 0x100u);
    if (mode < 4) return false;
    const auto allFull = [block](int first, int bits, int ends) {
        return bitsOf(block, first, bits * ends) == (1u << bits * ends) - 1;
    };
    switch (mode) {
        case 4:  // 5 bits of mode, 2 of rotation, 1 of index; 2 ends of 5 bits of red, green, blue each, 2 of 6 bits of
                 // alpha
        case 5: {  // 6 bits of mode, 2 of rotation; 2 ends of 7 bits each, 2 of 8
            const int rotation = static_cast<int>(bitsOf(block, mode + 1, 2));
            const int start = 8, bits = mode == 4 ? 5 : 7, alphaBits = mode == 4 ? 6 : 8;
            return rotation == 0 ? !allFull(start + 6 * bits, alphaBits, 2)
                                 : !allFull(start + 2 * bits * (rotation - 1), bits, 2);
        }
        case 6:  // 7 bits of mode; 2 ends of 7 bits of four channels, and a lowest bit for each end
            return !(allFull(7 + 42, 7, 2) && bitsOf(block, 63, 2) == 3);
        case 7:  // 8 bits of mode, 6 of partition; 4 ends of 5 bits of four channels, and a lowest bit for each end
            return !(allFull(14 + 60, 5, 4) && bitsOf(block, 94, 4) == 15);
        default:  // no mode: decoded as transparent black
            return true;
    }
}

}  // namespace

bool isCompressed(std::int64_t encoding) {
    return encoding >= Image::kBc1 && encoding <= Image::kBc7;
}

std::uint64_t unitBytes(std::int64_t encoding) {
    if (!isCompressed(encoding)) return 4;
    return encoding == Image::kBc1 || encoding == Image::kBc4 ? 8 : 16;
}

std::int64_t mostMipmaps(const Image& image) {
    const std::int64_t longest =
        std::max({image.widthPx, image.heightPx, image.shape == Image::kSolid ? image.depthPx : 1, std::int64_t{1}});
    return static_cast<std::int64_t>(std::bit_width(static_cast<std::uint64_t>(longest)));
}

std::vector<ImageLevel> levelsOf(const Image& image) {
    const bool compressed = isCompressed(image.encoding);
    std::vector<ImageLevel> levels;
    std::uint64_t offset = 0;
    for (std::int64_t i = 0; i < image.mipmaps; ++i) {
        const auto half = [i](std::int64_t px) { return std::max<std::int64_t>(1, px >> i); };
        ImageLevel level{.widthPx = half(image.widthPx), .heightPx = half(image.heightPx), .offset = offset};
        level.depthPx = image.shape == Image::kSolid ? half(image.depthPx) : image.shape == Image::kCube ? 6 : 1;
        level.sliceBytes = unitsAcross(level.widthPx, compressed) * unitsAcross(level.heightPx, compressed) *
                           unitBytes(image.encoding);
        level.sizeBytes = level.sliceBytes * static_cast<std::uint64_t>(level.depthPx);
        offset += level.sizeBytes;
        levels.push_back(level);
    }
    return levels;
}

Expected<void> checkImage(const Image& image) {
    const std::uint64_t given = image.pixels.sizeBytes();
    if (given == 0) return {};
    static constexpr std::array<const char*, 4> kShapes = {"flat", "line", "solid", "cube"};
    // The table of types bounds them.
    const auto shape = static_cast<std::size_t>(image.shape);
    const std::int64_t most = image.shape == Image::kSolid  ? kMostSolid
                              : image.shape == Image::kCube ? kMostCube
                                                            : kMostFlat;
    if (image.widthPx < 1 || image.heightPx < 1 || image.widthPx > most || image.heightPx > most)
        return misfit(fmt::format("a {} image of {} × {} pixels: 1 to {} a side there may be", kShapes[shape],
                                  image.widthPx, image.heightPx, most));
    if (image.shape == Image::kLine && image.heightPx != 1)
        return misfit(fmt::format("a line is one pixel high, and this one {}", image.heightPx));
    if (image.shape == Image::kCube && image.widthPx != image.heightPx)
        return misfit(fmt::format("a cube's faces are squares, not {} × {} pixels", image.widthPx, image.heightPx));
    if (image.shape == Image::kSolid ? image.depthPx > kMostSolid : image.depthPx != 1)
        return misfit(
            image.shape == Image::kSolid
                ? fmt::format("a solid of {} slices: 1 to {} there may be", image.depthPx, kMostSolid)
                : fmt::format("of a {} image depthPx is 1, and here it is {}", kShapes[shape], image.depthPx));
    if (image.encoding == Image::kRgbe && (image.shape == Image::kLine || image.shape == Image::kSolid))
        return misfit("pixels of encoding rgbe are flat images and cubes");
    if (!isCompressed(image.encoding) && image.mipmaps != 1)
        return misfit(fmt::format(
            "mipmaps come with compressed pixels alone; of others they are made, and `mipmaps` is 1, not {}",
            image.mipmaps));
    if (image.mipmaps > mostMipmaps(image))
        return misfit(fmt::format("{} × {} pixels have {} mipmaps, not {}", image.widthPx, image.heightPx,
                                  mostMipmaps(image), image.mipmaps));
    const ImageLevel last = levelsOf(image).back();
    if (const std::uint64_t needed = last.offset + last.sizeBytes; needed != given) {
        const std::string slices = image.shape == Image::kSolid  ? fmt::format(" × {}", image.depthPx)
                                   : image.shape == Image::kCube ? " × 6"
                                                                 : "";
        const std::string mipmaps = image.mipmaps > 1 ? fmt::format(" with {} mipmaps", image.mipmaps) : "";
        return misfit(fmt::format("{} bytes are not {} × {}{} pixels{}, which take {}", given, image.widthPx,
                                  image.heightPx, slices, mipmaps, needed));
    }
    return {};
}

bool isOpaque(const Image& image) {
    const ByteSpan bytes = image.pixels.bytes();
    const auto none = [bytes](std::size_t step, auto&& letsThrough) {
        for (std::size_t at = 0; at + step <= bytes.size(); at += step)
            if (letsThrough(bytes.data() + at)) return false;
        return true;
    };
    switch (image.encoding) {
        case Image::kSrgb:
            return none(4, [](const std::byte* pixel) { return pixel[3] != std::byte{0xff}; });
        case Image::kBc1:
            return none(8, bc1LetsThrough);
        case Image::kBc2:
            return none(16, [](const std::byte* block) {
                return std::any_of(block, block + 8, [](std::byte b) { return b != std::byte{0xff}; });
            });
        case Image::kBc3:
            return none(16, bc3LetsThrough);
        case Image::kBc7:
            return none(16, bc7LetsThrough);
        default:
            return true;
    }
}

}  // namespace tessera
