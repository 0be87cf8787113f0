#include "server/import/reader/blocks/AstcIntegers.h"

namespace tessera {
namespace {

constexpr unsigned bitOf(unsigned value, unsigned at) {
    return value >> at & 1;
}

/// Five trits of 8 bits.
constexpr std::array<std::uint8_t, 5> tritsOf(unsigned packed) {
    unsigned rest = 0, t[5] = {};
    if ((packed >> 2 & 7) == 7) {
        rest = (packed >> 5 & 7) << 2 | (packed & 3);
        t[4] = t[3] = 2;
    } else {
        rest = packed & 31;
        const bool two = (packed >> 5 & 3) == 3;
        t[4] = two ? 2 : bitOf(packed, 7);
        t[3] = two ? bitOf(packed, 7) : packed >> 5 & 3;
    }
    if ((rest & 3) == 3) {
        t[2] = 2;
        t[1] = bitOf(rest, 4);
        t[0] = bitOf(rest, 3) << 1 | (bitOf(rest, 2) & ~bitOf(rest, 3));
    } else if ((rest >> 2 & 3) == 3) {
        t[2] = t[1] = 2;
        t[0] = rest & 3;
    } else {
        t[2] = bitOf(rest, 4);
        t[1] = rest >> 2 & 3;
        t[0] = bitOf(rest, 1) << 1 | (bitOf(rest, 0) & ~bitOf(rest, 1));
    }
    std::array<std::uint8_t, 5> trits{};
    for (std::size_t i = 0; i < 5; ++i) trits[i] = static_cast<std::uint8_t>(t[i]);
    return trits;
}

/// Three quints of 7 bits.
constexpr std::array<std::uint8_t, 3> quintsOf(unsigned packed) {
    unsigned rest = 0, q[3] = {};
    if ((packed >> 1 & 3) == 3 && (packed >> 5 & 3) == 0) {
        const unsigned none = 1 - bitOf(packed, 0);
        q[2] = bitOf(packed, 0) << 2 | (bitOf(packed, 4) & none) << 1 | (bitOf(packed, 3) & none);
        q[1] = q[0] = 4;
    } else {
        if ((packed >> 1 & 3) == 3) {
            q[2] = 4;
            rest = (packed >> 3 & 3) << 3 | (~packed >> 5 & 3) << 1 | bitOf(packed, 0);
        } else {
            q[2] = packed >> 5 & 3;
            rest = packed & 31;
        }
        const bool four = (rest & 7) == 5;
        q[1] = four ? 4 : rest >> 3 & 3;
        q[0] = four ? rest >> 3 & 3 : rest & 7;
    }
    std::array<std::uint8_t, 3> quints{};
    for (std::size_t i = 0; i < 3; ++i) quints[i] = static_cast<std::uint8_t>(q[i]);
    return quints;
}

/// Of each packed number what it stands for.
template <std::size_t kCount, std::size_t kPackings, typename Unpack>
constexpr auto tableOf(Unpack unpack) {
    std::array<std::array<std::uint8_t, kCount>, kPackings> table{};
    for (unsigned packed = 0; packed < kPackings; ++packed) table[packed] = unpack(packed);
    return table;
}
constexpr auto kTrits = tableOf<5, 256>(tritsOf);
constexpr auto kQuints = tableOf<3, 128>(quintsOf);

/// How the bits of a trit's or quint's number stand among the others: behind each value's own so many.
constexpr std::array<unsigned, 5> kTritBits = {2, 2, 1, 2, 1};
constexpr std::array<unsigned, 3> kQuintBits = {3, 2, 2};

/// `value`'s lowest `from` bits, repeated until there are `to`.
constexpr unsigned repeated(unsigned value, unsigned from, unsigned to) {
    unsigned result = 0;
    for (unsigned have = 0; have < to; have += from)
        result |= to >= have + from ? value << (to - have - from) : value >> (have + from - to);
    return result;
}

/// What is added for the bits of a value beside its trit or quint, but its lowest: `at[i]`, where bit i of them goes,
/// as a mask. And what a trit or quint is worth.
struct Scale {
    unsigned worth = 0;
    std::array<unsigned, 5> at{};
};
constexpr Scale colourScale(const AstcRange& range) {
    switch (range.bits) {
        case 1:
            return range.trit ? Scale{204, {}} : Scale{113, {}};
        case 2:
            return range.trit ? Scale{93, {0b100010110}} : Scale{54, {0b100001100}};
        case 3:
            return range.trit ? Scale{44, {0b010000101, 0b100001010}} : Scale{26, {0b010000010, 0b100000101}};
        case 4:
            return range.trit ? Scale{22, {0b001000001, 0b010000010, 0b100000100}}
                              : Scale{13, {0b001000000, 0b010000001, 0b100000010}};
        case 5:
            return range.trit ? Scale{11, {0b000100000, 0b001000000, 0b010000001, 0b100000010}}
                              : Scale{6, {0b000100000, 0b001000000, 0b010000000, 0b100000001}};
        default:
            return Scale{5, {0b000010000, 0b000100000, 0b001000000, 0b010000000, 0b100000001}};
    }
}
constexpr Scale weightScale(const AstcRange& range) {
    switch (range.bits) {
        case 1:
            return range.trit ? Scale{50, {}} : Scale{28, {}};
        case 2:
            return range.trit ? Scale{23, {0b1000101}} : Scale{13, {0b1000010}};
        default:
            return Scale{11, {0b0100001, 0b1000010}};
    }
}

/// Sections 23.14 and 23.15: of a value with a trit or quint its `width` highest bits of `width` + 1.
constexpr unsigned scaled(const AstcRange& range, const Scale& scale, unsigned value, unsigned width) {
    const unsigned digit = value >> range.bits, all = (2u << width) - 1;
    unsigned sum = digit * scale.worth;
    for (unsigned i = 1; i < range.bits; ++i)
        if (bitOf(value, i)) sum += scale.at[i - 1];
    sum ^= bitOf(value, 0) ? all : 0;
    const unsigned top = 1u << (width - 1);
    return ((bitOf(value, 0) ? all : 0) & top) | sum >> 2;
}

constexpr unsigned colourOf(const AstcRange& range, unsigned value) {
    return range.trit || range.quint ? scaled(range, colourScale(range), value, 8) : repeated(value, range.bits, 8);
}

constexpr unsigned weightOf(const AstcRange& range, unsigned value) {
    constexpr unsigned kOfTrits[] = {0, 32, 63}, kOfQuints[] = {0, 16, 32, 47, 63};
    const unsigned weight = !range.trit && !range.quint ? repeated(value, range.bits, 6)
                            : range.bits > 0            ? scaled(range, weightScale(range), value, 6)
                            : range.trit                ? kOfTrits[value]
                                                        : kOfQuints[value];
    return weight > 32 ? weight + 1 : weight;
}

constexpr unsigned levelsOf(const AstcRange& range) {
    return (range.trit ? 3u : range.quint ? 5u : 1u) << range.bits;
}

constexpr std::size_t kSmallestOfColours = 4, kWeightRanges = 12;

template <std::size_t kRanges, std::size_t kLevels, typename Meaning>
constexpr auto meanings(std::size_t first, Meaning meaning) {
    std::array<std::array<std::uint8_t, kLevels>, kRanges> table{};
    for (std::size_t range = first; range < kRanges; ++range)
        for (unsigned value = 0; value < levelsOf(kAstcRanges[range]); ++value)
            table[range][value] = static_cast<std::uint8_t>(meaning(kAstcRanges[range], value));
    return table;
}
constexpr auto kColours = meanings<kAstcRanges.size(), 256>(kSmallestOfColours, colourOf);
constexpr auto kWeights = meanings<kWeightRanges, 32>(0, weightOf);

/// `values` in groups of as many as `digits`, whose trits or quints are one number in parts.
template <std::size_t kGroup, typename Digits>
void readGroups(AstcBits bits, unsigned ownBits, const std::array<unsigned, kGroup>& partBits, const Digits& digits,
                std::span<std::uint8_t> values) {
    unsigned at = 0;
    for (std::size_t first = 0; first < values.size(); first += kGroup) {
        unsigned own[kGroup] = {}, packed = 0, got = 0;
        for (std::size_t i = 0; i < kGroup; ++i) {
            own[i] = bits.number(at, ownBits);
            at += ownBits;
            packed |= bits.number(at, partBits[i]) << got;
            at += partBits[i];
            got += partBits[i];
        }
        for (std::size_t i = 0; i < kGroup && first + i < values.size(); ++i)
            values[first + i] = static_cast<std::uint8_t>(unsigned{digits[packed][i]} << ownBits | own[i]);
    }
}

}  // namespace

unsigned astcSequenceBits(const AstcRange& range, unsigned count) {
    return count * range.bits + (range.trit ? (8 * count + 4) / 5 : range.quint ? (7 * count + 2) / 3 : 0);
}

void readAstcSequence(AstcBits bits, const AstcRange& range, std::span<std::uint8_t> values) {
    bits = bits.part(0, astcSequenceBits(range, static_cast<unsigned>(values.size())));
    if (range.trit) return readGroups(bits, range.bits, kTritBits, kTrits, values);
    if (range.quint) return readGroups(bits, range.bits, kQuintBits, kQuints, values);
    for (std::size_t i = 0; i < values.size(); ++i)
        values[i] = static_cast<std::uint8_t>(bits.number(static_cast<unsigned>(i) * range.bits, range.bits));
}

std::uint8_t astcColour(std::size_t range, std::uint8_t value) {
    return kColours[range][value];
}

std::uint8_t astcWeight(std::size_t range, std::uint8_t value) {
    return kWeights[range][value];
}

}  // namespace tessera
