// Is a mesh a grid of heights?
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <unordered_set>

#include "server/collision/representation/HeightField.h"

namespace tessera {

namespace {

constexpr std::uint32_t kNoCell = 0xffffffffU;
/// Vertices of holes may be missing, but a grid of which most is missing is no help.
constexpr std::size_t kMostPlacesPerVertex = 4;

std::optional<bool> ascending(const std::vector<double>& x) {
    for (std::size_t i = 1; i < x.size(); ++i)
        if (x[i] == x[i - 1] || (x[i] > x[i - 1]) != (x[1] > x[0])) return std::nullopt;
    return x[1] > x[0];
}

/// Different values along an axis, ascending; nothing where there are more than `most`.
std::optional<std::vector<double>> fewValues(const MeshPositions& positions, int axis, std::size_t most) {
    std::unordered_set<double> seen;
    double last = std::numeric_limits<double>::quiet_NaN();
    for (const Vec3d& p : positions) {
        if (p[axis] == last) continue;
        last = p[axis] + 0.0;  // one zero
        seen.insert(last);
        if (seen.size() > most) return std::nullopt;
    }
    std::vector<double> out(seen.begin(), seen.end());
    std::ranges::sort(out);
    return out;
}

}  // namespace

struct HeightField::FoundGrid {
    std::array<int, 3> axes;
    std::vector<double> columns, rows;
    GridOrder order;
    std::vector<std::uint32_t> placeOfVertex;  ///< empty where `order` tells

    [[nodiscard]] GridOrder::Place place(std::uint32_t vertex) const {
        if (placeOfVertex.empty()) return order.place(vertex);
        const auto width = static_cast<std::uint32_t>(columns.size());
        return {placeOfVertex[vertex] % width, placeOfVertex[vertex] / width};
    }
    /// Vertices line by line: along one axis the same within a line, along the other the same in each.
    static std::optional<FoundGrid> lineByLine(const MeshPositions& positions, int slow, int fast);
    /// Nothing where there are no rows and columns; an error where two vertices are in one place.
    static std::optional<Expected<FoundGrid>> inAnyOrder(const MeshPositions& positions, int heights);
};

std::optional<HeightField::FoundGrid> HeightField::FoundGrid::lineByLine(const MeshPositions& positions, int slow,
                                                                         int fast) {
    const std::size_t all = positions.size();
    std::size_t width = 1;
    while (width < all && positions[width][slow] == positions[0][slow]) ++width;
    if (width < 2 || width == all || all % width != 0) return std::nullopt;
    FoundGrid out{.axes = {fast, slow, 3 - fast - slow}};
    for (std::size_t i = 0; i < width; ++i) out.columns.push_back(positions[i][fast]);
    for (std::size_t i = 0; i < all; i += width) out.rows.push_back(positions[i][slow]);
    const std::optional<bool> right = ascending(out.columns), up = ascending(out.rows);
    if (!right || !up) return std::nullopt;
    std::size_t i = 0;
    for (const double row : out.rows)
        for (const double column : out.columns) {
            const Vec3d p = positions[i++];
            if (p[fast] != column || p[slow] != row) return std::nullopt;
        }
    out.order = {static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(all / width), false, !*right, !*up};
    if (!*right) std::ranges::reverse(out.columns);
    if (!*up) std::ranges::reverse(out.rows);
    return out;
}

std::optional<Expected<HeightField::FoundGrid>> HeightField::FoundGrid::inAnyOrder(const MeshPositions& positions,
                                                                                   int heights) {
    const std::size_t all = positions.size();
    FoundGrid out{.axes = {heights == 0 ? 1 : 0, heights == 2 ? 1 : 2, heights}};
    // One side of a grid is short; who has no axis of few coordinates is found out at once.
    const std::size_t few = static_cast<std::size_t>(std::sqrt(static_cast<double>(kMostPlacesPerVertex * all))) + 1;
    std::optional<std::vector<double>> columns = fewValues(positions, out.axes[0], few),
                                       rows = fewValues(positions, out.axes[1], few);
    if (!columns && !rows) return std::nullopt;
    if (!columns)
        columns = fewValues(positions, out.axes[0], kMostPlacesPerVertex * all / rows->size());
    else if (!rows)
        rows = fewValues(positions, out.axes[1], kMostPlacesPerVertex * all / columns->size());
    if (!columns || !rows || columns->size() < 2 || rows->size() < 2 ||
        columns->size() * rows->size() > kMostPlacesPerVertex * all)
        return std::nullopt;
    out.columns = *std::move(columns);
    out.rows = *std::move(rows);
    std::vector<std::uint32_t> vertexAt(out.columns.size() * out.rows.size(), kNoCell);
    out.placeOfVertex.reserve(all);
    for (const Vec3d& p : positions) {
        const auto column = std::ranges::lower_bound(out.columns, p[out.axes[0]]) - out.columns.begin();
        const auto row = std::ranges::lower_bound(out.rows, p[out.axes[1]]) - out.rows.begin();
        const std::size_t place = static_cast<std::size_t>(row) * out.columns.size() + static_cast<std::size_t>(column);
        const auto vertex = static_cast<std::uint32_t>(out.placeOfVertex.size());
        if (vertexAt[place] != kNoCell)
            return fail(ErrorCode::kBadInput, "vertices " + std::to_string(vertexAt[place]) + " and " +
                                                  std::to_string(vertex) + " are above each other");
        vertexAt[place] = vertex;
        out.placeOfVertex.push_back(static_cast<std::uint32_t>(place));
    }
    return out;
}

struct HeightField::FoundFaces {
    std::vector<std::uint8_t> shapeOf;
    std::vector<std::uint32_t> faceOfSlot;  ///< kNoCell for holes
    GridAxis::Cells columns, rows;          ///< in use
};

Expected<HeightField::FoundFaces> HeightField::findFaces(const TriangleMesh& mesh, const FoundGrid& grid) {
    const auto width = static_cast<std::uint32_t>(grid.columns.size() - 1);
    const std::size_t cells = std::size_t{width} * (grid.rows.size() - 1);
    FoundFaces out;
    out.shapeOf.assign(cells, 0);
    out.faceOfSlot.assign(2 * cells, kNoCell);
    out.columns = out.rows = {kNoCell, 0};
    for (std::uint32_t face = 0; face < mesh.faceCount(); ++face) {
        std::array<GridOrder::Place, 3> at;
        for (unsigned i = 0; i < 3; ++i) at[i] = grid.place(mesh.vertexOf(face, i));
        const std::uint32_t column = std::min({at[0].column, at[1].column, at[2].column}),
                            row = std::min({at[0].row, at[1].row, at[2].row});
        std::array<std::uint32_t, 3> number;
        std::uint32_t seen = 0;
        for (unsigned i = 0; i < 3; ++i) {
            const std::uint32_t right = at[i].column - column, up = at[i].row - row;
            if (right > 1 || up > 1)
                return fail(ErrorCode::kBadInput,
                            "triangle " + std::to_string(face) + " is larger than a cell of the grid");
            number[i] = right + 2 * up;
            seen |= 1U << number[i];
        }
        const std::uint32_t missing = 6 - number[0] - number[1] - number[2];
        if (seen + (1U << missing) != 15)
            return fail(ErrorCode::kBadInput, "triangle " + std::to_string(face) + " is no half of a cell of the grid");
        const std::uint32_t diagonal = missing == 0 || missing == 3, half = missing < 2;
        const std::size_t cell = std::size_t{row} * width + column;
        std::uint32_t& slot = out.faceOfSlot[2 * cell + half];
        if (slot != kNoCell)
            return fail(ErrorCode::kBadInput, "triangles " + std::to_string(slot) + " and " + std::to_string(face) +
                                                  " lie on top of each other");
        if (const std::uint32_t other = out.faceOfSlot[2 * cell + 1 - half];
            other != kNoCell && out.shapeOf[cell] / 49 != diagonal)
            return fail(ErrorCode::kBadInput, "triangles " + std::to_string(other) + " and " + std::to_string(face) +
                                                  " divide a cell along both diagonals");
        slot = face;
        const std::uint32_t before = (number[0] > number[1]) + (number[0] > number[2]);
        const std::uint32_t order = 1 + 2 * before + (number[1] > number[2]);
        if (out.shapeOf[cell] == 0) out.shapeOf[cell] = static_cast<std::uint8_t>(49 * diagonal);
        out.shapeOf[cell] = static_cast<std::uint8_t>(out.shapeOf[cell] + order * (half == 0 ? 7 : 1));
        out.columns = {std::min(out.columns.first, column), std::max(out.columns.end, column + 1)};
        out.rows = {std::min(out.rows.first, row), std::max(out.rows.end, row + 1)};
    }
    return out;
}

void HeightField::takeFaces(FoundFaces faces) {
    usedColumns_ = faces.columns;
    usedRows_ = faces.rows;
    const bool whole = std::ranges::find(faces.faceOfSlot, kNoCell) == faces.faceOfSlot.end();
    oneShape_ = faces.shapeOf[0];
    if (!whole || std::ranges::any_of(faces.shapeOf, [&](std::uint8_t shape) { return shape != oneShape_; }))
        shapeOf_ = std::move(faces.shapeOf);
    const std::uint32_t width = columns_.cells(), cells = static_cast<std::uint32_t>(faces.faceOfSlot.size() / 2);
    const auto ordered = [&] {
        std::array<bool, 2> known{false, false};
        for (std::uint32_t cell = 0; cell < cells; ++cell) {
            const std::uint32_t column = cell % width, row = cell / width, first = 2 * faceOrder_.rank(column, row);
            const std::uint32_t a = faces.faceOfSlot[2 * cell], b = faces.faceOfSlot[2 * cell + 1];
            const std::uint8_t diagonal = shapeAt(column, row).diagonal;
            if (!known[diagonal]) secondFirst_[diagonal] = a == first + 1;
            known[diagonal] = true;
            if (a != first + secondFirst_[diagonal] || b != first + 1 - secondFirst_[diagonal]) return false;
        }
        return true;
    };
    for (unsigned i = 0; whole && i < 8; ++i) {
        faceOrder_ = {width, rows_.cells(), (i & 1U) != 0, (i & 2U) != 0, (i & 4U) != 0};
        if (ordered()) return;
    }
    faceOfSlot_ = std::move(faces.faceOfSlot);
    slotOfFace_.resize(faceCount_);
    for (std::uint32_t slot = 0; slot < faceOfSlot_.size(); ++slot)
        if (faceOfSlot_[slot] != kNoCell) slotOfFace_[faceOfSlot_[slot]] = slot;
}

Expected<HeightField> HeightField::recognise(const TriangleMesh& mesh) {
    const MeshPositions positions = mesh.positions();
    if (mesh.faceCount() == 0) return fail(ErrorCode::kBadInput, "no triangles");
    std::optional<FoundGrid> grid;
    FoundFaces faces;
    std::optional<Error> why;
    const auto fits = [&](FoundGrid&& candidate) {
        Expected<FoundFaces> found = findFaces(mesh, candidate);
        if (found) {
            faces = *std::move(found);
            grid = std::move(candidate);
        } else if (!why) {
            why = std::move(found.error());
        }
        return grid.has_value();
    };
    std::array<bool, 3> tried{};
    for (int heights = 2; !grid && heights >= 0; --heights)
        for (const bool swapped : {false, true}) {
            const int first = heights == 0 ? 1 : 0, second = heights == 2 ? 1 : 2;
            std::optional<FoundGrid> found =
                FoundGrid::lineByLine(positions, swapped ? first : second, swapped ? second : first);
            if (!found) continue;
            tried[static_cast<std::size_t>(heights)] = true;
            if (fits(*std::move(found))) break;
        }
    for (int heights = 2; !grid && heights >= 0; --heights) {
        if (tried[static_cast<std::size_t>(heights)]) continue;
        std::optional<Expected<FoundGrid>> found = FoundGrid::inAnyOrder(positions, heights);
        if (!found) continue;
        if (*found)
            fits(**std::move(found));
        else if (!why)
            why = std::move(found->error());
    }
    if (!grid && why) return tl::unexpected<Error>(*std::move(why));
    if (!grid) return fail(ErrorCode::kBadInput, "the vertices do not lie in rows and columns");

    HeightField out;
    out.axes_ = grid->axes;
    out.columns_ = GridAxis(std::move(grid->columns));
    out.rows_ = GridAxis(std::move(grid->rows));
    out.faceCount_ = mesh.faceCount();
    out.vertexCount_ = positions.size();
    out.vertexOrder_ = grid->order;
    out.placeOfVertex_ = std::move(grid->placeOfVertex);
    out.takeHeights(positions);
    out.takeFaces(std::move(faces));
    out.makeLevels();
    out.findBounds();
    return out;
}

}  // namespace tessera
