#include "server/import/reader/blocks/AstcWeights.h"

namespace tessera {

AstcWeights::AstcWeights(const AstcBits& block, const AstcBlockMode& mode, unsigned width, unsigned height)
    : gridWidth_(mode.width),
      planes_(mode.planes),
      columns_(places(width, mode.width)),
      rows_(places(height, mode.height)) {
    const std::span<std::uint8_t> grid(grid_.data(), mode.weights());
    readAstcSequence(block.reversed(), kAstcRanges[mode.range], grid);
    for (std::uint8_t& weight : grid) weight = astcWeight(mode.range, weight);
}

std::array<AstcWeights::Place, 12> AstcWeights::places(unsigned texels, unsigned grid) {
    std::array<Place, 12> found;
    const unsigned step = (1024 + texels / 2) / (texels - 1);
    for (unsigned i = 0; i < texels; ++i) {
        const unsigned at = (step * i * (grid - 1) + 32) >> 6;
        found[i] = {at >> 4, at & 15};
    }
    return found;
}

unsigned AstcWeights::at(unsigned x, unsigned y, unsigned plane) const {
    const Place &column = columns_[x], &row = rows_[y];
    const unsigned both = (column.sixteenths * row.sixteenths + 8) >> 4;
    const unsigned right = column.sixteenths - both, below = row.sixteenths - both,
                   here = 16 - column.sixteenths - row.sixteenths + both;
    const std::uint8_t* weight = &grid_[(row.first * gridWidth_ + column.first) * planes_ + plane];
    const unsigned down = gridWidth_ * planes_;
    return (weight[0] * here + weight[planes_] * right + weight[down] * below + weight[down + planes_] * both + 8) >> 4;
}

}  // namespace tessera
