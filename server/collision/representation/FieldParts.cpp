#include "server/collision/representation/FieldParts.h"

namespace tessera {

FieldPartNumbers::Block FieldPartNumbers::blockOf(std::uint32_t number) const {
    std::size_t l = field.levels().size() - 1;
    while (field.levels()[l].start > number) --l;
    const HeightField::Level& level = field.levels()[l];
    return {l, (number - level.start) % level.columns, (number - level.start) / level.columns};
}

Box FieldPartNumbers::boxOf(std::uint32_t part) const {
    if (!isLeaf(part)) {
        const Block block = blockOf(part);
        const HeightField::Level& level = field.levels()[block.level];
        const auto cells = [](std::uint32_t number, std::uint32_t size, std::uint32_t all) {
            return GridAxis::Cells{number * size, std::min((number + 1) * size, all)};
        };
        return boxOf({cells(block.column, level.cellColumns, field.columns().cells()),
                      cells(block.row, level.cellRows, field.rows().cells())},
                     field.range(part));
    }
    HeightRange heights;
    HeightField::Cells cells;
    eachTriangle(part, [&](std::uint32_t column, std::uint32_t row, unsigned half) {
        const std::array<double, 4> corners = field.heightsOf(column, row);
        for (const std::uint8_t corner : field.cornersOf(column, row, half)) heights.extend(corners[corner]);
        cells.columns = {cells.columns.empty() ? column : cells.columns.first, column + 1};
        cells.rows = {row, row + 1};
    });
    return boxOf(cells, heights);
}

Box FieldPartNumbers::boxOf(const HeightField::Cells& cells, const HeightRange& heights) const {
    Box box;
    if (!(heights.low <= heights.high)) return box;
    const auto set = [&](int axis, double low, double high) {
        box.lower[axis] = low;
        box.upper[axis] = high;
    };
    set(field.columnAxis(), field.columns()[cells.columns.first], field.columns()[cells.columns.end]);
    set(field.rowAxis(), field.rows()[cells.rows.first], field.rows()[cells.rows.end]);
    set(field.heightAxis(), heights.low, heights.high);
    return box;
}

}  // namespace tessera
