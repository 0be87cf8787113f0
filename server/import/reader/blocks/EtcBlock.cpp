#include "server/import/reader/blocks/EtcBlock.h"

#include <algorithm>
#include <array>

namespace tessera {
namespace {

using EtcColour = std::array<int, 3>;

/// The first byte has the highest bits.
std::uint64_t wordOf(const std::byte* block) {
    std::uint64_t word = 0;
    for (int i = 0; i < 8; ++i) word = word << 8 | std::to_integer<std::uint64_t>(block[i]);
    return word;
}

int field(std::uint64_t word, int lowest, int bits) {
    return static_cast<int>(word >> lowest & ((std::uint64_t{1} << bits) - 1));
}

/// A number of so many bits as one of eight: its highest bits again where there are none.
int widened(int value, int bits) {
    return (value << (8 - bits) | value >> (2 * bits - 8)) & 255;
}

int withSign(int value, int bits) {
    return value >= 1 << (bits - 1) ? value - (1 << bits) : value;
}

/// Texels lie in columns: this one's two bits, the high half of the word before the low.
int indexOf(std::uint64_t word, int x, int y) {
    const int texel = 4 * x + y;
    return field(word, 16 + texel, 1) << 1 | field(word, texel, 1);
}

void put(std::byte* rgba, int x, int y, const EtcColour& colour, int alpha) {
    std::byte* to = rgba + 4 * (4 * y + x);
    for (std::size_t c = 0; c < 3; ++c) to[c] = static_cast<std::byte>(std::clamp(colour[c], 0, 255));
    to[3] = static_cast<std::byte>(alpha);
}

EtcColour plus(const EtcColour& colour, int light) {
    return {colour[0] + light, colour[1] + light, colour[2] + light};
}

/// One of four colours a texel. `cutOut`: the third is none at all.
void paint(std::uint64_t word, const std::array<EtcColour, 4>& paints, bool cutOut, std::byte* rgba) {
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 4; ++x) {
            const int index = indexOf(word, x, y);
            if (cutOut && index == 2)
                put(rgba, x, y, {}, 0);
            else
                put(rgba, x, y, paints[static_cast<std::size_t>(index)], 255);
        }
}

constexpr int kDistances[8] = {3, 6, 11, 16, 23, 32, 41, 64};

/// Mode "T": a colour by itself, three in a row.
void decodeT(std::uint64_t word, bool cutOut, std::byte* rgba) {
    const EtcColour lone = {widened(field(word, 59, 2) << 2 | field(word, 56, 2), 4), widened(field(word, 52, 4), 4),
                            widened(field(word, 48, 4), 4)};
    const EtcColour middle = {widened(field(word, 44, 4), 4), widened(field(word, 40, 4), 4),
                              widened(field(word, 36, 4), 4)};
    const int distance = kDistances[field(word, 34, 2) << 1 | field(word, 32, 1)];
    paint(word, {lone, plus(middle, distance), middle, plus(middle, -distance)}, cutOut, rgba);
}

/// Mode "H": two pairs. Which of the two colours is the larger is a bit of the distance.
void decodeH(std::uint64_t word, bool cutOut, std::byte* rgba) {
    const int first[3] = {field(word, 59, 4), field(word, 56, 3) << 1 | field(word, 52, 1),
                          field(word, 51, 1) << 3 | field(word, 47, 3)};
    const int second[3] = {field(word, 43, 4), field(word, 39, 4), field(word, 35, 4)};
    const bool larger = (first[0] << 8 | first[1] << 4 | first[2]) >= (second[0] << 8 | second[1] << 4 | second[2]);
    const int distance = kDistances[field(word, 34, 1) << 2 | field(word, 32, 1) << 1 | int{larger}];
    EtcColour a{}, b{};
    for (std::size_t c = 0; c < 3; ++c) {
        a[c] = widened(first[c], 4);
        b[c] = widened(second[c], 4);
    }
    paint(word, {plus(a, distance), plus(a, -distance), plus(b, distance), plus(b, -distance)}, cutOut, rgba);
}

/// Mode "planar": colours at three corners, and a plane through these.
void decodePlanar(std::uint64_t word, std::byte* rgba) {
    const EtcColour origin = {widened(field(word, 57, 6), 6), widened(field(word, 56, 1) << 6 | field(word, 49, 6), 7),
                              widened(field(word, 48, 1) << 5 | field(word, 43, 2) << 3 | field(word, 39, 3), 6)};
    const EtcColour right = {widened(field(word, 34, 5) << 1 | field(word, 32, 1), 6), widened(field(word, 25, 7), 7),
                             widened(field(word, 19, 6), 6)};
    const EtcColour below = {widened(field(word, 13, 6), 6), widened(field(word, 6, 7), 7),
                             widened(field(word, 0, 6), 6)};
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 4; ++x) {
            EtcColour colour{};
            for (std::size_t c = 0; c < 3; ++c)
                colour[c] = (x * (right[c] - origin[c]) + y * (below[c] - origin[c]) + 4 * origin[c] + 2) >> 2;
            put(rgba, x, y, colour, 255);
        }
}

/// ETC1's own: two halves, of each a colour and eight tables of how light or dark a texel is.
void decodeHalves(std::uint64_t word, const std::array<EtcColour, 2>& bases, bool cutOut, std::byte* rgba) {
    constexpr int kLights[8][2] = {{2, 8}, {5, 17}, {9, 29}, {13, 42}, {18, 60}, {24, 80}, {33, 106}, {47, 183}};
    const bool above = field(word, 32, 1) != 0;
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 4; ++x) {
            const std::size_t half = (above ? y : x) < 2 ? 0 : 1;
            const int* lights = kLights[field(word, half == 0 ? 37 : 34, 3)];
            const int index = indexOf(word, x, y);
            if (cutOut && index == 2) {
                put(rgba, x, y, {}, 0);
                continue;
            }
            const int size = cutOut && index == 0 ? 0 : lights[index & 1];
            put(rgba, x, y, plus(bases[half], index & 2 ? -size : size), 255);
        }
}

void decodeColours(std::uint64_t word, bool mayCutOut, std::byte* rgba) {
    // The bit that says of ETC1 whether the second colour is a difference is what is opaque where texels may be clear.
    const bool opaque = field(word, 33, 1) != 0;
    std::array<EtcColour, 2> bases{};
    if (!mayCutOut && !opaque) {
        for (std::size_t c = 0; c < 3; ++c)
            for (std::size_t half = 0; half < 2; ++half)
                bases[half][c] = widened(field(word, 60 - 8 * static_cast<int>(c) - 4 * static_cast<int>(half), 4), 4);
        return decodeHalves(word, bases, false, rgba);
    }
    const bool cutOut = mayCutOut && !opaque;
    for (std::size_t c = 0; c < 3; ++c) {
        const int base = field(word, 59 - 8 * static_cast<int>(c), 5),
                  other = base + withSign(field(word, 56 - 8 * static_cast<int>(c), 3), 3);
        // Where ETC1 has no such number stand ETC2's modes.
        if (other < 0 || other > 31) {
            if (c == 0) return decodeT(word, cutOut, rgba);
            if (c == 1) return decodeH(word, cutOut, rgba);
            return decodePlanar(word, rgba);
        }
        bases[0][c] = widened(base, 5);
        bases[1][c] = widened(other, 5);
    }
    decodeHalves(word, bases, cutOut, rgba);
}

/// By how much a texel of EAC differs from the base: sixteen tables of eight, of which the second four are the first
/// four's opposites, less one.
constexpr int kDifferences[16][4] = {{-3, -6, -9, -15}, {-3, -7, -10, -13}, {-2, -5, -8, -13}, {-2, -4, -6, -13},
                                     {-3, -6, -8, -12}, {-3, -7, -9, -11},  {-4, -7, -8, -11}, {-3, -5, -8, -11},
                                     {-2, -6, -8, -10}, {-2, -5, -8, -10},  {-2, -4, -8, -10}, {-2, -5, -7, -10},
                                     {-3, -4, -7, -10}, {-1, -2, -3, -10},  {-4, -6, -8, -9},  {-3, -5, -7, -9}};

struct EacTexels {
    int base = 0, multiplier = 0;
    std::array<int, 16> difference{};  ///< rows from the top
};

EacTexels eacTexels(std::uint64_t word) {
    EacTexels texels{.base = field(word, 56, 8), .multiplier = field(word, 52, 4)};
    const int* table = kDifferences[field(word, 48, 4)];
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 4; ++x) {
            const int index = field(word, 45 - 3 * (4 * x + y), 3);
            texels.difference[static_cast<std::size_t>(4 * y + x)] = index < 4 ? table[index] : -table[index - 4] - 1;
        }
    return texels;
}

void decodeAlpha(std::uint64_t word, std::byte* rgba) {
    const EacTexels texels = eacTexels(word);
    for (std::size_t i = 0; i < 16; ++i)
        rgba[4 * i + 3] =
            static_cast<std::byte>(std::clamp(texels.base + texels.difference[i] * texels.multiplier, 0, 255));
}

/// A channel of eleven bits, rounded to eight.
void decodeEleven(std::uint64_t word, bool hasSign, std::byte* channel) {
    const EacTexels texels = eacTexels(word);
    const int size = texels.multiplier == 0 ? 1 : 8 * texels.multiplier;
    for (std::size_t i = 0; i < 16; ++i, channel += 4) {
        const int difference = texels.difference[i] * size;
        if (hasSign) {
            // -128 is the same as -127.
            const int base = std::max(withSign(texels.base, 8), -127);
            const int value = std::clamp(8 * base + difference, -1023, 1023);
            *channel = static_cast<std::byte>(((value + 1023) * 255 + 1022) / 2046);
        } else {
            const int value = std::clamp(8 * texels.base + 4 + difference, 0, 2047);
            *channel = static_cast<std::byte>((value * 255 + 1023) / 2047);
        }
    }
}

void setAll(std::byte* rgba, std::size_t channel, const std::byte* other, std::byte value) {
    for (std::size_t i = 0; i < 16; ++i) rgba[4 * i + channel] = other ? other[4 * i] : value;
}

}  // namespace

void decodeEtcBlock(EtcFormat format, const std::byte* block, std::byte* rgba) {
    const bool hasSign = format == EtcFormat::kSignedRed || format == EtcFormat::kSignedRedGreen;
    switch (format) {
        case EtcFormat::kRgb:
        case EtcFormat::kRgbCutOut:
            return decodeColours(wordOf(block), format == EtcFormat::kRgbCutOut, rgba);
        case EtcFormat::kRgba:
            decodeColours(wordOf(block + 8), false, rgba);
            return decodeAlpha(wordOf(block), rgba);
        case EtcFormat::kRed:
        case EtcFormat::kSignedRed:
            decodeEleven(wordOf(block), hasSign, rgba);
            setAll(rgba, 1, rgba, {});
            setAll(rgba, 2, rgba, {});
            return setAll(rgba, 3, nullptr, std::byte{255});
        case EtcFormat::kRedGreen:
        case EtcFormat::kSignedRedGreen:
            decodeEleven(wordOf(block), hasSign, rgba);
            decodeEleven(wordOf(block + 8), hasSign, rgba + 1);
            setAll(rgba, 2, nullptr, {});
            return setAll(rgba, 3, nullptr, std::byte{255});
    }
}

}  // namespace tessera
