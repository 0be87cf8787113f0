#include "common/freeform/subdivision/ApproximatePatch.h"

#include <algorithm>

#include "common/freeform/BezierTriangle.h"

namespace tessera {
namespace {

void addLimit(RowSum& sum, const CornerLimit& limit, std::size_t row, double weight) {
    for (std::uint32_t i = limit.rows.begin[row]; i < limit.rows.begin[row + 1]; ++i)
        sum.add(limit.rows.columns[i], weight * limit.rows.weights[i]);
}

/// The point inside a quadrilateral of the sector, near the corner.
void addInterior(RowSum& sum, const TaggedMesh& mesh, const Sector& sector, std::size_t which, double weight) {
    const Sector::Face& f = sector.faces[which];
    const auto vertices = mesh.verticesOf(f.face);
    const auto at = [&](std::uint32_t steps) { return vertices[(f.at + steps) % 4]; };
    const double valence = static_cast<double>(sector.faces.size()) * (sector.closed ? 1 : 2);
    // Where the surface ends beside one or two faces the masks of valence 4 are exact.
    const double n = sector.closed ? valence : std::max(valence, 4.0);
    sum.add(at(0), weight * n / (n + 5));
    sum.add(at(1), weight * 2 / (n + 5));
    sum.add(at(3), weight * 2 / (n + 5));
    sum.add(at(2), weight / (n + 5));
}

SparseRows quadrilateralRows(const TaggedMesh& mesh, std::span<const CornerLimit* const> limits) {
    constexpr std::array<std::size_t, 4> kCorner{0, 3, 15, 12};
    constexpr std::array<std::ptrdiff_t, 4> kOut{1, 4, -1, -4}, kIn{4, -1, -4, 1};
    std::array<SparseRows, 16> rows;
    RowSum sum(mesh.vertexCount());
    for (std::uint32_t c = 0; c < 4; ++c) {
        const Sector sector = sectorOf(mesh, 0, c);
        const std::size_t faces = sector.faces.size(), here = sector.center;
        const auto place = [&](std::ptrdiff_t offset) -> SparseRows& {
            return rows[static_cast<std::size_t>(static_cast<std::ptrdiff_t>(kCorner[c]) + offset)];
        };
        addLimit(sum, *limits[c], 0, 1);
        sum.moveInto(place(0));
        addInterior(sum, mesh, sector, here, 1);
        sum.moveInto(place(kOut[c] + kIn[c]));
        // Towards the next and the previous corner: between the interiors on both sides, or on a crease.
        const auto edges = mesh.edgesOf(0);
        for (const bool out : {true, false}) {
            const std::uint32_t edge = edges[out ? c : (c + 3) % 4], end = out ? (c + 1) % 4 : (c + 3) % 4;
            if (mesh.edges[edge].sharpness > 0) {
                sum.add(c, 2.0 / 3);
                sum.add(end, 1.0 / 3);
            } else {
                const std::size_t beside = out ? (here + faces - 1) % faces : (here + 1) % faces;
                addInterior(sum, mesh, sector, here, 0.5);
                addInterior(sum, mesh, sector, beside, 0.5);
            }
            sum.moveInto(place(out ? kOut[c] : kIn[c]));
        }
    }
    SparseRows all;
    for (const SparseRows& row : rows) {
        all.columns.insert(all.columns.end(), row.columns.begin(), row.columns.end());
        all.weights.insert(all.weights.end(), row.weights.begin(), row.weights.end());
        all.endRow();
    }
    return all;
}

/// Across edge `c` of the triangle; beyond a crease, where the box spline has it.
void addAcross(RowSum& sum, const TaggedMesh& mesh, std::uint32_t c, double weight) {
    const TaggedMesh::Edge& edge = mesh.edges[mesh.edgesOf(0)[c]];
    const std::uint32_t other = edge.faces[0] == 0 ? edge.faces[1] : edge.faces[0];
    if (edge.sharpness > 0 || other == kNoIndex) {
        sum.add(c, weight);
        sum.add((c + 1) % 3, weight);
        sum.add((c + 2) % 3, -weight);
        return;
    }
    for (const std::uint32_t v : mesh.verticesOf(other)) {
        if (v != edge.vertices[0] && v != edge.vertices[1]) sum.add(v, weight);
    }
}

SparseRows triangleRows(const TaggedMesh& mesh, std::span<const CornerLimit* const> limits) {
    std::array<SparseRows, 15> rows;
    RowSum sum(mesh.vertexCount());
    // (i, j) of the point with these multiples of corner c, the next and the one before.
    const auto place = [&](std::uint32_t c, int here, int next, int before) -> SparseRows& {
        std::array<int, 3> count{};
        count[c] = here;
        count[(c + 1) % 3] = next;
        count[(c + 2) % 3] = before;
        return rows[BezierTriangle::index(4, count[1], count[2])];
    };
    for (std::uint32_t c = 0; c < 3; ++c) {
        const std::uint32_t next = (c + 1) % 3, before = (c + 2) % 3;
        addLimit(sum, *limits[c], 0, 1);
        sum.moveInto(place(c, 4, 0, 0));
        addLimit(sum, *limits[c], 0, 1);
        addLimit(sum, *limits[c], 1, 0.25);
        sum.moveInto(place(c, 3, 1, 0));
        addLimit(sum, *limits[c], 0, 1);
        addLimit(sum, *limits[c], 2, 0.25);
        sum.moveInto(place(c, 3, 0, 1));
        sum.add(c, 8.0 / 24);
        sum.add(next, 8.0 / 24);
        sum.add(before, 4.0 / 24);
        addAcross(sum, mesh, c, 4.0 / 24);
        sum.moveInto(place(c, 2, 2, 0));
        sum.add(c, 10.0 / 24);
        sum.add(next, 6.0 / 24);
        sum.add(before, 6.0 / 24);
        addAcross(sum, mesh, c, 1.0 / 24);
        addAcross(sum, mesh, before, 1.0 / 24);
        sum.moveInto(place(c, 2, 1, 1));
    }
    SparseRows all;
    for (const SparseRows& row : rows) {
        all.columns.insert(all.columns.end(), row.columns.begin(), row.columns.end());
        all.weights.insert(all.weights.end(), row.weights.begin(), row.weights.end());
        all.endRow();
    }
    return all;
}

}  // namespace

std::optional<SparseRows> approximatePatchOf(const TaggedMesh& mesh, SubdivisionScheme scheme,
                                             std::span<const CornerLimit* const> limits) {
    const std::uint32_t size = scheme == SubdivisionScheme::kLoop ? 3 : 4;
    if (mesh.faceSize(0) != size) return std::nullopt;
    for (std::uint32_t c = 0; c < size; ++c) {
        if (!isSettled(mesh, c, scheme)) return std::nullopt;
    }
    return size == 4 ? quadrilateralRows(mesh, limits) : triangleRows(mesh, limits);
}

}  // namespace tessera
