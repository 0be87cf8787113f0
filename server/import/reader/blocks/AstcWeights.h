/// The weights of an ASTC block, from the grid that it holds to its texels: Khronos Data Format Specification 1.3,
/// sections 23.19 and 23.20.
#pragma once

#include <array>

#include "server/import/reader/blocks/AstcBlockMode.h"

namespace tessera {

class AstcWeights {
public:
    /// Of a block of `width` × `height` texels, whose bits these are.
    AstcWeights(const AstcBits& block, const AstcBlockMode& mode, unsigned width, unsigned height);
    /// Of a texel in the first or second plane, 0 to 64.
    [[nodiscard]] unsigned at(unsigned x, unsigned y, unsigned plane) const;

private:
    /// Between which two of the grid a texel lies, and how many sixteenths away from the first.
    struct Place {
        unsigned first = 0, sixteenths = 0;
    };
    static std::array<Place, 12> places(unsigned texels, unsigned grid);

    unsigned gridWidth_, planes_;
    std::array<Place, 12> columns_, rows_;
    /// Behind the last are what no sixteenth is taken of.
    std::array<std::uint8_t, 64 + 2 * 13> grid_{};
};

}  // namespace tessera
