#include "server/import/reader/blocks/AstcEndpoints.h"

#include <algorithm>

namespace tessera {
namespace {

using Colour = std::array<int, 4>;

constexpr int kOpaque = 255;

/// Red and green nearer to blue: so two orders of the same colours are two encodings.
Colour contracted(const Colour& colour) {
    return {(colour[0] + colour[2]) >> 1, (colour[1] + colour[2]) >> 1, colour[2], colour[3]};
}

Colour bounded(Colour colour) {
    for (int& channel : colour) channel = std::clamp(channel, 0, 255);
    return colour;
}

/// A pair of numbers: an offset with a sign, whose highest bit goes to the base.
struct BaseAndOffset {
    int base = 0, offset = 0;
    BaseAndOffset(int first, int second) : base(first >> 1 | (second & 0x80)), offset(second >> 1 & 0x3f) {
        if (offset & 0x20) offset -= 0x40;
    }
};

/// Colours of numbers in turns; `alpha` of both.
AstcEndpoints direct(const std::uint8_t* n, int alphaFrom, int alphaTo) {
    const Colour even = {n[0], n[2], n[4], alphaFrom}, odd = {n[1], n[3], n[5], alphaTo};
    if (n[1] + n[3] + n[5] >= n[0] + n[2] + n[4]) return {even, odd};
    return {contracted({n[1], n[3], n[5], alphaTo}), contracted({n[0], n[2], n[4], alphaFrom})};
}

/// A colour and what the other differs by.
AstcEndpoints offset(const std::uint8_t* n, const BaseAndOffset* alpha) {
    const BaseAndOffset red(n[0], n[1]), green(n[2], n[3]), blue(n[4], n[5]);
    const Colour base = {red.base, green.base, blue.base, alpha ? alpha->base : kOpaque};
    const Colour other = {red.base + red.offset, green.base + green.offset, blue.base + blue.offset,
                          alpha ? alpha->base + alpha->offset : kOpaque};
    if (red.offset + green.offset + blue.offset >= 0) return {bounded(base), bounded(other)};
    return {bounded(contracted(other)), bounded(contracted(base))};
}

/// A colour, and how dark the other is beside it.
AstcEndpoints scaled(const std::uint8_t* n, int alphaFrom, int alphaTo) {
    return {{n[0] * n[3] >> 8, n[1] * n[3] >> 8, n[2] * n[3] >> 8, alphaFrom}, {n[0], n[1], n[2], alphaTo}};
}

AstcEndpoints grey(int from, int to, int alphaFrom, int alphaTo) {
    return {{from, from, from, alphaFrom}, {to, to, to, alphaTo}};
}

}  // namespace

std::optional<AstcEndpoints> astcEndpoints(unsigned mode, const std::uint8_t* n) {
    switch (mode) {
        case 0:
            return grey(n[0], n[1], kOpaque, kOpaque);
        case 1: {
            const int base = n[0] >> 2 | (n[1] & 0xc0);
            return grey(base, std::min(255, base + (n[1] & 0x3f)), kOpaque, kOpaque);
        }
        case 4:
            return grey(n[0], n[1], n[2], n[3]);
        case 5: {
            const BaseAndOffset light(n[0], n[1]), alpha(n[2], n[3]);
            const AstcEndpoints found =
                grey(light.base, light.base + light.offset, alpha.base, alpha.base + alpha.offset);
            return AstcEndpoints{bounded(found.from), bounded(found.to)};
        }
        case 6:
            return scaled(n, kOpaque, kOpaque);
        case 8:
            return direct(n, kOpaque, kOpaque);
        case 9:
            return offset(n, nullptr);
        case 10:
            return scaled(n, n[4], n[5]);
        case 12:
            return direct(n, n[6], n[7]);
        case 13: {
            const BaseAndOffset alpha(n[6], n[7]);
            return offset(n, &alpha);
        }
        default:
            return std::nullopt;
    }
}

}  // namespace tessera
