#include "server/import/reader/blocks/AstcPartition.h"

namespace tessera {
namespace {

/// The specification's hash52.
std::uint32_t hashOf(std::uint32_t value) {
    value ^= value >> 15;
    value -= value << 17;
    value += value << 7;
    value += value << 4;
    value ^= value >> 5;
    value += value << 16;
    value ^= value >> 7;
    value ^= value >> 3;
    value ^= value << 6;
    value ^= value >> 17;
    return value;
}

}  // namespace

AstcPartition::AstcPartition(unsigned pattern, unsigned parts, bool small)
    : parts_(parts), scale_(small ? 2 : 1), hash_(hashOf(pattern + (parts - 1) * 1024)) {
    const bool odd = pattern & 1;
    const unsigned byPattern = pattern & 2 ? 4 : 5, byParts = parts == 3 ? 6 : 5;
    const unsigned shiftX = odd ? byPattern : byParts, shiftY = odd ? byParts : byPattern;
    // Eight numbers of four bits, squared: a pair for each part.
    for (unsigned part = 0; part < 4; ++part) {
        const unsigned x = hash_ >> 8 * part & 15, y = hash_ >> (8 * part + 4) & 15;
        acrossX_[part] = x * x >> shiftX;
        acrossY_[part] = y * y >> shiftY;
    }
}

unsigned AstcPartition::at(unsigned x, unsigned y) const {
    constexpr unsigned kOffset[4] = {14, 10, 6, 2};
    unsigned best = 0, most = 0;
    for (unsigned part = 0; part < parts_; ++part) {
        const unsigned value =
            (acrossX_[part] * x * scale_ + acrossY_[part] * y * scale_ + (hash_ >> kOffset[part])) & 63;
        if (part > 0 && value <= most) continue;
        best = part;
        most = value;
    }
    return best;
}

}  // namespace tessera
