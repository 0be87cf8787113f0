/// The parts of a HeightField: the blocks of its pyramid, and below the finest of them leaves of two cells side by
/// side.
#pragma once

#include <algorithm>

#include "server/collision/representation/BodyParts.h"
#include "server/collision/representation/HeightField.h"

namespace tessera {

/// How a HeightField's parts are numbered: blocks as in its pyramid, leaves after them.
struct FieldPartNumbers {
    static constexpr std::uint32_t kLeafColumns = 2;
    static constexpr std::uint32_t kLeavesPerRow = HeightField::kBlockColumns / kLeafColumns;
    static constexpr std::uint32_t kLeavesPerBlock = kLeavesPerRow * HeightField::kBlockRows;

    explicit FieldPartNumbers(const HeightField& of)
        : field(of),
          firstLeaf(field.levels().back().start + field.levels().back().columns * field.levels().back().rows) {}

    [[nodiscard]] bool isLeaf(std::uint32_t part) const { return part >= firstLeaf; }
    /// Up to sixteen that are not empty: found(number, is it a leaf, the box around it in the field's frame).
    template <typename Found>
    void open(std::uint32_t block, Found&& found) const;
    /// In the field's frame; empty where there is nothing.
    [[nodiscard]] Box boxOf(std::uint32_t part) const;
    /// found(column, row, half) of the triangles of a leaf.
    template <typename Found>
    void eachTriangle(std::uint32_t leaf, Found&& found) const;

    const HeightField& field;
    std::uint32_t firstLeaf;

private:
    struct Block {
        std::size_t level;
        std::uint32_t column, row;
    };
    [[nodiscard]] Block blockOf(std::uint32_t number) const;
    [[nodiscard]] Box boxOf(const HeightField::Cells& cells, const HeightRange& heights) const;
};

template <typename Found>
void FieldPartNumbers::open(std::uint32_t block, Found&& found) const {
    const Block of = blockOf(block);
    const auto give = [&](std::uint32_t number, bool leaf) {
        const Box box = boxOf(number);
        if (!box.empty()) found(number, leaf, box);
    };
    if (of.level + 1 == field.levels().size()) {
        const std::uint32_t first = firstLeaf + (block - field.levels().back().start) * kLeavesPerBlock;
        for (std::uint32_t k = 0; k < kLeavesPerBlock; ++k) give(first + k, true);
        return;
    }
    const HeightField::Level& finer = field.levels()[of.level + 1];
    constexpr std::uint32_t n = HeightField::kFanOut;
    for (std::uint32_t r = of.row * n; r < std::min((of.row + 1) * n, finer.rows); ++r)
        for (std::uint32_t c = of.column * n; c < std::min((of.column + 1) * n, finer.columns); ++c)
            give(finer.start + r * finer.columns + c, false);
}

template <typename Found>
void FieldPartNumbers::eachTriangle(std::uint32_t leaf, Found&& found) const {
    const HeightField::Level& finest = field.levels().back();
    const std::uint32_t block = (leaf - firstLeaf) / kLeavesPerBlock, k = (leaf - firstLeaf) % kLeavesPerBlock;
    const std::uint32_t row = block / finest.columns * HeightField::kBlockRows + k / kLeavesPerRow;
    const std::uint32_t column = block % finest.columns * HeightField::kBlockColumns + k % kLeavesPerRow * kLeafColumns;
    if (row >= field.rows().cells()) return;
    for (std::uint32_t c = column; c < std::min(column + kLeafColumns, field.columns().cells()); ++c)
        for (unsigned half = 0; half < 2; ++half)
            if (field.has(c, row, half)) found(c, row, half);
}

class FieldParts final : public NumberedParts {
public:
    explicit FieldParts(const HeightField& field, const Affine3d& target_T_field = Affine3d::Identity())
        : NumberedParts(FieldPartNumbers(field).firstLeaf),
          numbers_(field),
          map_(target_T_field, reachOf(field.bounds())) {}

    void whole(PartBoxes& out) const override {
        out.count = 0;
        out.add(0, false, map_(numbers_.field.bounds()));
    }
    void open(std::uint32_t part, PartBoxes& out) const override {
        out.count = 0;
        numbers_.open(part, [&](std::uint32_t number, bool leaf, const Box& box) { out.add(number, leaf, map_(box)); });
    }
    [[nodiscard]] Box box(std::uint32_t part) const override { return map_(numbers_.boxOf(part)); }
    void faces(std::uint32_t leaf, LeafFaces& out) const override {
        out.count = 0;
        numbers_.eachTriangle(leaf, [&](std::uint32_t column, std::uint32_t row, unsigned half) {
            out.face[out.count++] = numbers_.field.faceOf(column, row, half);
        });
    }
    [[nodiscard]] Triangle triangle(std::uint32_t face) const override { return numbers_.field.triangle(face); }
    [[nodiscard]] std::size_t faceCount() const override { return numbers_.field.faceCount(); }

private:
    FieldPartNumbers numbers_;
    BoxMap map_;
};

}  // namespace tessera
