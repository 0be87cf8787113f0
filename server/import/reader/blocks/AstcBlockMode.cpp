#include "server/import/reader/blocks/AstcBlockMode.h"

namespace tessera {
namespace {

constexpr unsigned kMostWeights = 64, kFewestWeightBits = 24, kMostWeightBits = 96;

/// The grid's sizes where the two lowest bits are not zero: `a` and `b` are numbers of two bits.
void setCommonGrid(AstcBlockMode& mode, unsigned bits, unsigned a, unsigned b) {
    switch (bits >> 2 & 3) {
        case 0:
            mode.width = b + 4, mode.height = a + 2;
            return;
        case 1:
            mode.width = b + 8, mode.height = a + 2;
            return;
        case 2:
            mode.width = a + 2, mode.height = b + 8;
            return;
        default:
            // Of b one bit is left: the other says which of two.
            if (b & 2)
                mode.width = (b & 1) + 2, mode.height = a + 2;
            else
                mode.width = a + 2, mode.height = (b & 1) + 6;
    }
}

/// And where both are. False: reserved.
bool setLongGrid(AstcBlockMode& mode, unsigned bits, unsigned a) {
    switch (bits >> 7 & 3) {
        case 0:
            mode.width = 12, mode.height = a + 2;
            return true;
        case 1:
            mode.width = a + 2, mode.height = 12;
            return true;
        case 2:
            mode.width = a + 6, mode.height = (bits >> 9 & 3) + 6;
            return true;
        default:
            if (a > 1) return false;
            mode.width = a == 0 ? 6 : 10, mode.height = a == 0 ? 10 : 6;
            return true;
    }
}

}  // namespace

std::optional<AstcBlockMode> astcBlockMode(unsigned bits) {
    AstcBlockMode mode;
    const unsigned a = bits >> 5 & 3;
    const bool common = (bits & 3) != 0;
    const unsigned range = (common ? bits & 3 : bits >> 2 & 3) << 1 | (bits >> 4 & 1);
    if (range < 2) return std::nullopt;
    if (common)
        setCommonGrid(mode, bits, a, bits >> 7 & 3);
    else if (!setLongGrid(mode, bits, a))
        return std::nullopt;
    // Of the grids whose sizes take these two bits there is neither.
    const bool plain = !common && (bits >> 7 & 3) == 2;
    const bool precise = !plain && (bits >> 9 & 1);
    mode.planes = !plain && (bits >> 10 & 1) ? 2 : 1;
    mode.range = range - 2 + (precise ? 6 : 0);
    if (mode.weights() > kMostWeights || mode.weightBits() < kFewestWeightBits || mode.weightBits() > kMostWeightBits)
        return std::nullopt;
    return mode;
}

}  // namespace tessera
