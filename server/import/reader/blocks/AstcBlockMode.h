/// What the first eleven bits of an ASTC block say of its weights: Khronos Data Format Specification 1.3,
/// section 23.10.
#pragma once

#include <optional>

#include "server/import/reader/blocks/AstcIntegers.h"

namespace tessera {

struct AstcBlockMode {
    unsigned width = 0, height = 0;  ///< of the grid of weights
    std::size_t range = 0;           ///< index of the weights' range
    unsigned planes = 1;             ///< 2: a channel has weights of its own

    [[nodiscard]] unsigned weights() const { return width * height * planes; }
    [[nodiscard]] unsigned weightBits() const { return astcSequenceBits(kAstcRanges[range], weights()); }
};

/// Of blocks in two dimensions. None: the bits are reserved, or the weights are more than a block may have.
[[nodiscard]] std::optional<AstcBlockMode> astcBlockMode(unsigned bits);

}  // namespace tessera
