#include "server/import/reader/blocks/AstcBlock.h"

#include <algorithm>
#include <array>
#include <optional>

#include "server/import/reader/blocks/AstcEndpoints.h"
#include "server/import/reader/blocks/AstcPartition.h"
#include "server/import/reader/blocks/AstcWeights.h"

namespace tessera {
namespace {

constexpr std::uint8_t kMagenta[4] = {255, 0, 255, 255};
constexpr unsigned kMostColourNumbers = 18;

/// A number of 16 bits as 8: as a float of 16 bits holds it, which the specification makes of it, and rounded.
std::uint8_t eightBits(unsigned value) {
    if (value == 0xffff) return 255;
    const int beyond = std::max(0, 32 - std::countl_zero(value) - 11);
    return static_cast<std::uint8_t>(((value >> beyond << beyond) * 255 + 0x8000) >> 16);
}

/// The endpoint modes of all parts, and where the numbers lie that endpoints are made of.
struct ColourLayout {
    std::array<unsigned, 4> modes{};
    unsigned parts = 1, begin = 0, end = 0;
    unsigned ownWeights = 4;  ///< the channel that has the second plane's; 4: none
    [[nodiscard]] unsigned numbers() const {
        unsigned sum = 0;
        for (unsigned i = 0; i < parts; ++i) sum += astcEndpointNumbers(modes[i]);
        return sum;
    }
};

/// Sections 23.11 and 23.16. None: nothing is left for colours.
std::optional<ColourLayout> colourLayout(const AstcBits& bits, const AstcBlockMode& mode) {
    ColourLayout layout{.parts = bits.number(11, 2) + 1, .end = 128 - mode.weightBits()};
    if (layout.parts == 1) {
        layout.modes[0] = bits.number(13, 4);
        layout.begin = 17;
    } else {
        layout.begin = 29;
        const unsigned lowest = bits.number(23, 2);
        if (lowest == 0) {
            layout.modes.fill(bits.number(25, 4));
        } else {
            // A bit for each part, which of two classes it has, and two bits, which of a class's four modes. What has
            // no room in four bits lies right below the weights.
            const unsigned more = 3 * layout.parts - 4;
            layout.end -= more;
            const unsigned packed = bits.number(25, 4) | bits.number(layout.end, more) << 4;
            for (unsigned i = 0; i < layout.parts; ++i)
                layout.modes[i] = (lowest - 1 + (packed >> i & 1)) * 4 + (packed >> (layout.parts + 2 * i) & 3);
        }
    }
    if (mode.planes == 2) {
        layout.end -= 2;
        layout.ownWeights = bits.number(layout.end, 2);
    }
    if (layout.end < layout.begin) return std::nullopt;
    return layout;
}

/// The largest range of which all numbers find room.
std::optional<std::size_t> colourRange(const ColourLayout& layout) {
    constexpr std::size_t kSmallest = 4;
    for (std::size_t range = kAstcRanges.size(); range-- > kSmallest;)
        if (astcSequenceBits(kAstcRanges[range], layout.numbers()) <= layout.end - layout.begin) return range;
    return std::nullopt;
}

/// A block of one colour. Its extent may say how far that goes beyond the block: nobody has to know, but it has to make
/// sense. Section 23.22.
bool isSoundExtent(const AstcBits& bits) {
    if (bits.number(10, 2) != 3) return false;
    const unsigned fromX = bits.number(12, 13), toX = bits.number(25, 13), fromY = bits.number(38, 13),
                   toY = bits.number(51, 13);
    constexpr unsigned kNone = 0x1fff;
    return (fromX == kNone && toX == kNone && fromY == kNone && toY == kNone) || (fromX < toX && fromY < toY);
}

}  // namespace

AstcDecoder::Kind AstcDecoder::fill(Kind kind, const std::uint8_t* colour, std::byte* rgba) const {
    for (unsigned i = 0; i < width_ * height_; ++i)
        for (unsigned c = 0; c < 4; ++c) *rgba++ = std::byte{colour[c]};
    return kind;
}

AstcDecoder::Kind AstcDecoder::decode(const std::byte* block, std::byte* rgba) const {
    const AstcBits bits = AstcBits::of(block);
    if (bits.number(0, 9) != 0x1fc) return decodeParts(bits, rgba);
    if (bits.number(9, 1)) return fill(Kind::kHdr, kMagenta, rgba);
    if (!isSoundExtent(bits)) return fill(Kind::kReserved, kMagenta, rgba);
    std::uint8_t colour[4] = {};
    for (unsigned c = 0; c < 4; ++c) {
        const unsigned value = bits.number(64 + 16 * c, 16);
        colour[c] = colours_ == Colours::kSrgb ? static_cast<std::uint8_t>(value >> 8) : eightBits(value);
    }
    return fill(Kind::kShown, colour, rgba);
}

AstcDecoder::Kind AstcDecoder::decodeParts(const AstcBits& bits, std::byte* rgba) const {
    const std::optional<AstcBlockMode> mode = astcBlockMode(bits.number(0, 11));
    if (!mode || mode->width > width_ || mode->height > height_) return fill(Kind::kReserved, kMagenta, rgba);
    const std::optional<ColourLayout> layout = colourLayout(bits, *mode);
    if (!layout || (layout->parts == 4 && mode->planes == 2) || layout->numbers() > kMostColourNumbers)
        return fill(Kind::kReserved, kMagenta, rgba);
    const std::optional<std::size_t> range = colourRange(*layout);
    if (!range) return fill(Kind::kReserved, kMagenta, rgba);

    std::uint8_t numbers[kMostColourNumbers] = {};
    readAstcSequence(bits.part(layout->begin, layout->end - layout->begin), kAstcRanges[*range],
                     std::span(numbers, layout->numbers()));
    for (std::uint8_t& number : numbers) number = astcColour(*range, number);

    Kind kind = Kind::kShown;
    // With 16 bits a channel: what is between two of 8 is not lost.
    std::array<std::array<unsigned, 4>, 4> from{}, to{};
    const std::uint8_t* next = numbers;
    for (unsigned part = 0; part < layout->parts; ++part) {
        std::optional<AstcEndpoints> ends = astcEndpoints(layout->modes[part], next);
        next += astcEndpointNumbers(layout->modes[part]);
        if (!ends) {
            kind = Kind::kHdr;
            ends = AstcEndpoints{{255, 0, 255, 255}, {255, 0, 255, 255}};
        }
        for (unsigned c = 0; c < 4; ++c) {
            const auto wide = [&](int channel) {
                const auto value = static_cast<unsigned>(channel);
                return value << 8 | (colours_ == Colours::kSrgb ? 0x80 : value);
            };
            from[part][c] = wide(ends->from[c]);
            to[part][c] = wide(ends->to[c]);
        }
    }

    const AstcWeights weights(bits, *mode, width_, height_);
    const AstcPartition partition(bits.number(13, 10), layout->parts, width_ * height_ < 31);
    for (unsigned y = 0; y < height_; ++y)
        for (unsigned x = 0; x < width_; ++x, rgba += 4) {
            const unsigned part = layout->parts == 1 ? 0 : partition.at(x, y);
            const unsigned common = weights.at(x, y, 0), own = layout->ownWeights < 4 ? weights.at(x, y, 1) : common;
            for (unsigned c = 0; c < 4; ++c) {
                const unsigned weight = c == layout->ownWeights ? own : common;
                const unsigned value = (from[part][c] * (64 - weight) + to[part][c] * weight + 32) >> 6;
                rgba[c] =
                    std::byte{colours_ == Colours::kSrgb ? static_cast<std::uint8_t>(value >> 8) : eightBits(value)};
            }
        }
    return kind;
}

}  // namespace tessera
