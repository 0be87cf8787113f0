#include "server/collision/representation/HeightField.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

namespace tessera {

namespace {}  // namespace

// Sorted corners in the six orders; a half with order 0 is missing.
const std::array<HeightField::CellShape, HeightField::kCellShapes> HeightField::kShapes = [] {
    constexpr std::array<std::array<std::array<std::uint8_t, 3>, 2>, 2> kCorners{
        {{{{0, 1, 3}, {0, 2, 3}}}, {{{0, 1, 2}, {1, 2, 3}}}}};
    constexpr std::array<std::array<std::uint8_t, 3>, 6> kOrders{
        {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}};
    std::array<CellShape, kCellShapes> out{};
    for (std::size_t i = 0; i < kCellShapes; ++i) {
        out[i].diagonal = static_cast<std::uint8_t>(i / 49);
        const std::array<std::size_t, 2> orders{i / 7 % 7, i % 7};
        for (std::size_t half = 0; half < 2; ++half) {
            out[i].present[half] = orders[half] != 0;
            if (orders[half] == 0) continue;
            for (std::size_t k = 0; k < 3; ++k)
                out[i].corners[half][k] = kCorners[out[i].diagonal][half][kOrders[orders[half] - 1][k]];
        }
    }
    return out;
}();

HeightField::Slot HeightField::slotOf(std::uint32_t face) const {
    if (!slotOfFace_.empty()) {
        const std::uint32_t cell = slotOfFace_[face] / 2;
        return {cell % columns_.cells(), cell / columns_.cells(), slotOfFace_[face] % 2};
    }
    const GridOrder::Place at = faceOrder_.place(face / 2);
    return {at.column, at.row, face % 2 ^ secondFirst_[shapeAt(at.column, at.row).diagonal]};
}

std::size_t HeightField::placeOf(std::size_t vertex) const {
    if (!placeOfVertex_.empty()) return placeOfVertex_[vertex];
    const GridOrder::Place at = vertexOrder_.place(static_cast<std::uint32_t>(vertex));
    return std::size_t{at.row} * columns_.lines() + at.column;
}

void HeightField::takeHeights(const MeshPositions& positions) {
    const std::size_t places = std::size_t{columns_.lines()} * rows_.lines();
    const int axis = axes_[2];
    bool asFloats = true;
    for (std::size_t i = 0; asFloats && i < positions.size(); ++i) asFloats = isFloat(positions[i][axis]);
    floats_.assign(asFloats ? places : 0, 0);
    doubles_.assign(asFloats ? 0 : places, 0);
    for (std::size_t i = 0; i < positions.size(); ++i) {
        if (asFloats)
            floats_[placeOf(i)] = static_cast<float>(positions[i][axis]);
        else
            doubles_[placeOf(i)] = positions[i][axis];
    }
}

void HeightField::makeLevels() {
    levels_ = {{(columns_.cells() + kBlockColumns - 1) / kBlockColumns, (rows_.cells() + kBlockRows - 1) / kBlockRows,
                kBlockColumns, kBlockRows, 0}};
    while (levels_.back().columns > 1 || levels_.back().rows > 1) {
        const Level& finer = levels_.back();
        levels_.push_back({(finer.columns + kFanOut - 1) / kFanOut, (finer.rows + kFanOut - 1) / kFanOut,
                           finer.cellColumns * kFanOut, finer.cellRows * kFanOut, 0});
    }
    std::ranges::reverse(levels_);
    std::uint32_t blocks = 0;
    for (Level& level : levels_) {
        level.start = blocks;
        blocks += level.columns * level.rows;
    }
    ranges_.resize(blocks);
    std::vector<std::uint32_t> all(levels_.back().columns * std::size_t{levels_.back().rows});
    std::iota(all.begin(), all.end(), 0U);
    fit(std::move(all));
}

HeightRange HeightField::heightsBelow(std::uint32_t blockColumn, std::uint32_t blockRow) const {
    const std::uint32_t firstColumn = blockColumn * kBlockColumns, firstRow = blockRow * kBlockRows;
    const std::uint32_t endColumn = std::min(firstColumn + kBlockColumns, columns_.cells());
    const std::uint32_t endRow = std::min(firstRow + kBlockRows, rows_.cells());
    if (shapeOf_.empty()) return heightsAround({{firstColumn, endColumn}, {firstRow, endRow}});
    HeightRange out;
    for (std::uint32_t row = firstRow; row < endRow; ++row)
        for (std::uint32_t column = firstColumn; column < endColumn; ++column) {
            const std::array<double, 4> heights = heightsOf(column, row);
            for (unsigned half = 0; half < 2; ++half)
                if (has(column, row, half))
                    for (const std::uint8_t corner : cornersOf(column, row, half)) out.extend(heights[corner]);
        }
    return out;
}

std::size_t HeightField::fit(std::vector<std::uint32_t> blocks) {
    std::size_t looks = 0;
    for (std::size_t l = levels_.size(); l-- > 0;) {
        const Level& level = levels_[l];
        for (std::uint32_t& block : blocks) {
            const std::uint32_t column = block % level.columns, row = block / level.columns;
            HeightRange& range = ranges_[level.start + block];
            if (l + 1 == levels_.size()) {
                range = heightsBelow(column, row);
            } else {
                const Level& finer = levels_[l + 1];
                range = {};
                for (std::uint32_t r = row * kFanOut; r < std::min((row + 1) * kFanOut, finer.rows); ++r)
                    for (std::uint32_t c = column * kFanOut; c < std::min((column + 1) * kFanOut, finer.columns); ++c)
                        range.extend(this->range(finer, c, r));
            }
            ++looks;
            if (l > 0) block = row / kFanOut * levels_[l - 1].columns + column / kFanOut;
        }
        std::ranges::sort(blocks);
        blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
    }
    return looks;
}

void HeightField::findBounds() {
    bounds_ = {};
    const auto set = [&](int axis, double low, double high) {
        bounds_.lower[axis] = low;
        bounds_.upper[axis] = high;
    };
    set(axes_[0], columns_[usedColumns_.first], columns_[usedColumns_.end]);
    set(axes_[1], rows_[usedRows_.first], rows_[usedRows_.end]);
    set(axes_[2], ranges_[0].low, ranges_[0].high);
}

Expected<std::size_t> HeightField::refit(std::span<const Vec3d> positions, std::size_t first) {
    if (first > vertexCount_ || positions.size() > vertexCount_ - first)
        return fail(ErrorCode::kBadInput, "vertices " + std::to_string(first) + " to " +
                                              std::to_string(first + positions.size()) + " of " +
                                              std::to_string(vertexCount_));
    const std::uint32_t lines = columns_.lines();
    bool asFloats = true;
    for (std::size_t i = 0; i < positions.size(); ++i) {
        const Vec3d& p = positions[i];
        const std::size_t place = placeOf(first + i);
        if (!(p.cwiseAbs().maxCoeff() <= TriangleMeshLimits{}.maxCoordinate) || !p.allFinite())
            return fail(ErrorCode::kBadInput,
                        "vertex " + std::to_string(first + i) + " has a coordinate that is not finite or too large");
        if (p[axes_[0]] != columns_[place % lines] || p[axes_[1]] != rows_[place / lines])
            return fail(ErrorCode::kRefused, "vertex " + std::to_string(first + i) + " leaves its place in the grid");
        asFloats = asFloats && isFloat(p[axes_[2]]);
    }
    if (!asFloats && !floats_.empty()) {
        doubles_.assign(floats_.begin(), floats_.end());
        floats_ = {};
    }
    std::vector<std::uint32_t> blocks;
    const std::uint32_t blockColumns = levels_.back().columns;
    for (std::size_t i = 0; i < positions.size(); ++i) {
        const std::size_t place = placeOf(first + i);
        if (floats_.empty())
            doubles_[place] = positions[i][axes_[2]];
        else
            floats_[place] = static_cast<float>(positions[i][axes_[2]]);
        // The cells around a vertex lie in up to four blocks.
        const auto column = static_cast<std::uint32_t>(place % lines), row = static_cast<std::uint32_t>(place / lines);
        for (std::uint32_t r = (row == 0 ? 0 : row - 1) / kBlockRows;
             r <= std::min(row, rows_.cells() - 1) / kBlockRows; ++r)
            for (std::uint32_t c = (column == 0 ? 0 : column - 1) / kBlockColumns;
                 c <= std::min(column, columns_.cells() - 1) / kBlockColumns; ++c)
                if (const std::uint32_t block = r * blockColumns + c; blocks.empty() || blocks.back() != block)
                    blocks.push_back(block);
    }
    std::ranges::sort(blocks);
    blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
    const std::size_t looks = fit(std::move(blocks));
    findBounds();
    return looks;
}

std::size_t HeightField::memoryBytes() const {
    return sizeof(HeightField) + columns_.memoryBytes() + rows_.memoryBytes() + floats_.capacity() * sizeof(float) +
           doubles_.capacity() * sizeof(double) + shapeOf_.capacity() + levels_.capacity() * sizeof(Level) +
           ranges_.capacity() * sizeof(HeightRange) +
           (placeOfVertex_.capacity() + faceOfSlot_.capacity() + slotOfFace_.capacity()) * sizeof(std::uint32_t);
}

}  // namespace tessera
