/// A surface over a regular grid, as terrains are: one height per place of the grid and nothing else to store.
///
/// Cells lie between neighbouring lines of the grid; each holds two triangles along either of its diagonals, one of
/// them, or none (a hole). Above the cells stands a pyramid of the least and the greatest height of blocks of them,
/// from the whole down to 8 × 4 cells. What lies over a place is found by its coordinates, without a search.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "common/base/Error.h"
#include "common/math/Box.h"
#include "server/collision/mesh/TriangleMesh.h"
#include "server/collision/representation/GridAxis.h"

namespace tessera {

struct HeightRange {
    double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();
    void extend(double height) {
        low = height < low ? height : low;
        high = height > high ? height : high;
    }
    void extend(const HeightRange& other) {
        low = other.low < low ? other.low : low;
        high = other.high > high ? other.high : high;
    }
};

/// One of the eight orders of a grid's places that go row by row or column by column, from any corner.
struct GridOrder {
    std::uint32_t columns = 0, rows = 0;
    bool byColumns = false;
    bool fromRight = false, fromTop = false;

    struct Place {
        std::uint32_t column, row;
    };
    [[nodiscard]] std::uint32_t rank(std::uint32_t column, std::uint32_t row) const {
        if (fromRight) column = columns - 1 - column;
        if (fromTop) row = rows - 1 - row;
        return byColumns ? column * rows + row : row * columns + column;
    }
    [[nodiscard]] Place place(std::uint32_t rank) const {
        Place p = byColumns ? Place{rank / rows, rank % rows} : Place{rank % columns, rank / columns};
        if (fromRight) p.column = columns - 1 - p.column;
        if (fromTop) p.row = rows - 1 - p.row;
        return p;
    }
};

/// Queries by any number of threads, `refit` by one alone. Faces and vertices have the numbers that they had in the
/// mesh, and faces their corners in the mesh's order, to the bit.
class HeightField {
public:
    /// A field of the same triangles. The mesh's vertices lie on a grid along two of the axes: equal coordinates are
    /// exactly equal, spacing may differ. Vertices and faces may come in any order, faces with any winding; row-major
    /// orders take no memory. kBadInput says why the mesh is none: a vertex off the grid, two in one place, a triangle
    /// across several cells, two on top of each other, a cell divided along both diagonals. A mesh that is none costs
    /// little to find out.
    [[nodiscard]] static Expected<HeightField> recognise(const TriangleMesh& mesh);

    [[nodiscard]] std::size_t faceCount() const { return faceCount_; }
    [[nodiscard]] std::size_t vertexCount() const { return vertexCount_; }
    [[nodiscard]] Triangle triangle(std::uint32_t face) const {
        const Slot slot = slotOf(face);
        return triangleAt(slot.column, slot.row, slot.half);
    }
    /// The box around the triangles, as TriangleMesh::bounds.
    [[nodiscard]] const Box& bounds() const { return bounds_; }

    /// New positions of the vertices from `first` on: the grid stays, heights change. Costs what changed, and a pass
    /// over all once where heights that were floats are none any more. Returns how many blocks of the pyramid were
    /// looked at. Nothing is changed and kRefused says so where a vertex leaves its place in the grid; kBadInput for
    /// vertices that do not exist and for coordinates that TriangleMesh::make would refuse.
    Expected<std::size_t> refit(std::span<const Vec3d> positions, std::size_t first);

    /// All that it holds. In regular orders 2 (floats) or 4 bytes of heights and a quarter byte of pyramid per face;
    /// one byte per cell where cells differ in their diagonals, windings or holes; 8 bytes per face for faces in
    /// another order or with holes; 4 bytes per vertex for vertices in another order.
    [[nodiscard]] std::size_t memoryBytes() const;

    // The grid, for the queries of this library. Axes 0, 1, 2 are x, y, z.

    [[nodiscard]] int columnAxis() const { return axes_[0]; }
    [[nodiscard]] int rowAxis() const { return axes_[1]; }
    [[nodiscard]] int heightAxis() const { return axes_[2]; }
    [[nodiscard]] const GridAxis& columns() const { return columns_; }
    [[nodiscard]] const GridAxis& rows() const { return rows_; }

    struct Cells {
        GridAxis::Cells columns, rows;
        [[nodiscard]] bool empty() const { return columns.empty() || rows.empty(); }
        [[nodiscard]] std::size_t count() const { return empty() ? 0 : std::size_t{columns.count()} * rows.count(); }
    };
    /// Below or above a box, touching included.
    [[nodiscard]] Cells over(const Box& box) const {
        return {columns_.over(box.lower[axes_[0]], box.upper[axes_[0]]),
                rows_.over(box.lower[axes_[1]], box.upper[axes_[1]])};
    }

    /// The heights of a cell's corners: bit 0 of the number is the column's side, bit 1 the row's.
    [[nodiscard]] std::array<double, 4> heightsOf(std::uint32_t column, std::uint32_t row) const {
        const std::size_t at = std::size_t{row} * columns_.lines() + column, above = at + columns_.lines();
        return {height(at), height(at + 1), height(above), height(above + 1)};
    }
    /// Of all corners of some cells, those of holes included.
    [[nodiscard]] HeightRange heightsAround(const Cells& cells) const {
        HeightRange out;
        for (std::size_t row = cells.rows.first; row <= cells.rows.end; ++row)
            for (std::size_t column = cells.columns.first; column <= cells.columns.end; ++column)
                out.extend(height(row * columns_.lines() + column));
        return out;
    }
    [[nodiscard]] bool has(std::uint32_t column, std::uint32_t row, unsigned half) const {
        return shapeAt(column, row).present[half];
    }
    /// The numbers of the corners of one of a cell's two triangles, in the order of the mesh.
    [[nodiscard]] const std::array<std::uint8_t, 3>& cornersOf(std::uint32_t column, std::uint32_t row,
                                                               unsigned half) const {
        return shapeAt(column, row).corners[half];
    }
    [[nodiscard]] std::uint32_t faceOf(std::uint32_t column, std::uint32_t row, unsigned half) const {
        if (!faceOfSlot_.empty()) return faceOfSlot_[2 * (std::size_t{row} * columns_.cells() + column) + half];
        return 2 * faceOrder_.rank(column, row) + (half ^ secondFirst_[shapeAt(column, row).diagonal]);
    }
    [[nodiscard]] Vec3d corner(std::uint32_t column, std::uint32_t row, unsigned number) const {
        const std::uint32_t c = column + (number & 1U), r = row + (number >> 1U);
        Vec3d p;
        p[axes_[0]] = columns_[c];
        p[axes_[1]] = rows_[r];
        p[axes_[2]] = height(std::size_t{r} * columns_.lines() + c);
        return p;
    }
    [[nodiscard]] Triangle triangleAt(std::uint32_t column, std::uint32_t row, unsigned half) const {
        const std::array<std::uint8_t, 3>& c = cornersOf(column, row, half);
        return {corner(column, row, c[0]), corner(column, row, c[1]), corner(column, row, c[2])};
    }
    /// Where a face is.
    struct Slot {
        std::uint32_t column, row;
        unsigned half;
    };
    [[nodiscard]] Slot slotOf(std::uint32_t face) const;
    /// Where a vertex of the mesh is in the grid: row · lines of columns + column.
    [[nodiscard]] std::size_t placeOf(std::size_t vertex) const;

    /// Level 0 has one block, the whole; each has up to 4 × 4 blocks of the next.
    struct Level {
        std::uint32_t columns, rows;          ///< of blocks
        std::uint32_t cellColumns, cellRows;  ///< of cells of a block, but for the last ones
        std::uint32_t start;  ///< the number of its first block: all blocks are numbered, the whole is 0
    };
    static constexpr std::uint32_t kBlockColumns = 8, kBlockRows = 4, kFanOut = 4;
    [[nodiscard]] const std::vector<Level>& levels() const { return levels_; }
    /// Empty (low above high) for a block of holes.
    [[nodiscard]] const HeightRange& range(std::uint32_t block) const { return ranges_[block]; }
    [[nodiscard]] const HeightRange& range(const Level& level, std::uint32_t column, std::uint32_t row) const {
        return ranges_[level.start + std::size_t{row} * level.columns + column];
    }

private:
    /// How a cell is divided. Half 0 is the triangle with the edge between corners 0 and 1.
    struct CellShape {
        std::uint8_t diagonal;  ///< 0: from corner 0 to 3; 1: from 1 to 2
        std::array<bool, 2> present;
        std::array<std::array<std::uint8_t, 3>, 2> corners;
    };
    static constexpr std::size_t kCellShapes = 98;  ///< 2 diagonals, and 6 orders of the corners or none for each half
    static const std::array<CellShape, kCellShapes> kShapes;

    [[nodiscard]] const CellShape& shapeAt(std::uint32_t column, std::uint32_t row) const {
        return kShapes[shapeOf_.empty() ? oneShape_ : shapeOf_[std::size_t{row} * columns_.cells() + column]];
    }
    [[nodiscard]] double height(std::size_t place) const {
        return floats_.empty() ? doubles_[place] : static_cast<double>(floats_[place]);
    }

    struct FoundGrid;
    struct FoundFaces;
    static Expected<FoundFaces> findFaces(const TriangleMesh& mesh, const FoundGrid& grid);
    void takeHeights(const MeshPositions& positions);
    void takeFaces(FoundFaces faces);
    void makeLevels();
    [[nodiscard]] HeightRange heightsBelow(std::uint32_t blockColumn, std::uint32_t blockRow) const;
    /// Ascending numbers within the finest level; makes them anew and all above them. How many that is.
    std::size_t fit(std::vector<std::uint32_t> blocks);
    void findBounds();

    std::array<int, 3> axes_{0, 1, 2};  ///< of columns, rows, heights
    GridAxis columns_, rows_;
    std::size_t faceCount_ = 0, vertexCount_ = 0;
    /// Row by row, one of them empty: doubles where some height is no float. 0 where the mesh has no vertex.
    std::vector<float> floats_;
    std::vector<double> doubles_;
    GridOrder vertexOrder_;
    std::vector<std::uint32_t> placeOfVertex_;  ///< empty where vertexOrder_ tells
    std::uint8_t oneShape_ = 0;
    std::vector<std::uint8_t> shapeOf_;  ///< per cell; empty where all are oneShape_
    GridOrder faceOrder_;
    std::array<unsigned, 2> secondFirst_{0, 0};  ///< per diagonal: half 1 comes first
    std::vector<std::uint32_t> faceOfSlot_;      ///< two per cell; empty where faceOrder_ tells
    std::vector<std::uint32_t> slotOfFace_;
    GridAxis::Cells usedColumns_, usedRows_;  ///< all others have no triangles
    std::vector<Level> levels_;
    std::vector<HeightRange> ranges_;
    Box bounds_;
};

}  // namespace tessera
