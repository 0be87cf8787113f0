#include "common/freeform/subdivision/RegularPatch.h"

#include <algorithm>
#include <map>

#include "common/freeform/BezierTriangle.h"

namespace tessera {
namespace {

using GridPlace = std::array<int, 2>;
/// A point of the spline by those of the neighbourhood.
using PointSum = std::map<std::uint32_t, double>;

PointSum combination(std::initializer_list<std::pair<double, const PointSum*>> parts) {
    PointSum out;
    for (const auto& [weight, part] : parts) {
        for (const auto& [point, w] : *part) out[point] += weight * w;
    }
    return out;
}

/// Faces that a corner has in its sector where the surface is a spline, or 0 where it is none.
std::size_t regularSectorSize(const TaggedMesh& mesh, std::uint32_t corner, std::size_t whole) {
    const float sharpness = mesh.vertexSharpness[corner];
    if (sharpness > 0 && !isInfinitelySharp(sharpness)) return 0;
    int infinite = 0;
    for (const std::uint32_t e : mesh.edgesAt(corner)) {
        const TaggedMesh::Edge& edge = mesh.edges[e];
        if (edge.sharpness > 0 && !isInfinitelySharp(edge.sharpness)) return 0;
        if (edge.sharpness > 0 && edge.faces[0] == kNoIndex) return 0;
        infinite += edge.sharpness > 0 ? 1 : 0;
    }
    if (infinite == 0) return sharpness > 0 ? 0 : whole;
    if (infinite == 2) return sharpness > 0 ? 1 : whole / 2;
    return 0;
}

bool isRegular(const TaggedMesh& mesh, std::uint32_t faceSize, const std::vector<Sector>& sectors) {
    for (std::uint32_t f = 0; f < mesh.faceCount(); ++f) {
        if (mesh.faceSize(f) != faceSize) return false;
    }
    const std::size_t whole = faceSize == 4 ? 4 : 6;
    for (std::uint32_t c = 0; c < faceSize; ++c) {
        const std::size_t wanted = regularSectorSize(mesh, c, whole);
        if (sectors[c].faces.size() != wanted || sectors[c].closed != (wanted == whole)) return false;
    }
    return true;
}

GridPlace plus(const GridPlace& a, const GridPlace& b) {
    return {a[0] + b[0], a[1] + b[1]};
}

/// A spline's points while they are found.
class SplineGrid {
public:
    SplineGrid(const TaggedMesh& mesh, const std::vector<Sector>& sectors) : mesh_(mesh), sectors_(sectors) {}

    /// Puts the vertices of all faces around a corner in their places; `turn` leads from a step along an edge to the
    /// one along the next edge, counter-clockwise.
    template <typename Turn>
    void place(std::uint32_t corner, const GridPlace& at, const GridPlace& out, int whole, const Turn& turn) {
        const Sector& sector = sectors_[corner];
        for (std::size_t i = 0; i < sector.faces.size(); ++i) {
            GridPlace step = out;
            const int turns = (static_cast<int>(i) - static_cast<int>(sector.center) + whole) % whole;
            for (int k = 0; k < turns; ++k) step = turn(step);
            const auto vertices = mesh_.verticesOf(sector.faces[i].face);
            const std::uint32_t first = sector.faces[i].at;
            const auto size = static_cast<std::uint32_t>(vertices.size());
            const GridPlace side = turn(step);
            put(at, vertices[first]);
            put(plus(at, step), vertices[(first + 1) % size]);
            put(plus(at, side), vertices[(first + size - 1) % size]);
            if (size == 4) put(plus(plus(at, step), side), vertices[(first + 2) % size]);
        }
    }
    void put(const GridPlace& place, std::uint32_t point) { points[place] = {{point, 1.0}}; }
    [[nodiscard]] bool has(const GridPlace& place) const { return points.contains(place); }

    std::map<GridPlace, PointSum> points;

private:
    const TaggedMesh& mesh_;
    const std::vector<Sector>& sectors_;
};

void append(SparseRows& rows, const PointSum& sum) {
    for (const auto& [point, weight] : sum) {
        if (weight == 0) continue;
        rows.columns.push_back(point);
        rows.weights.push_back(weight);
    }
    rows.endRow();
}

SparseRows quadrilateralPatch(const TaggedMesh& mesh, const std::vector<Sector>& sectors) {
    constexpr std::array<GridPlace, 4> kCorners{{{1, 1}, {2, 1}, {2, 2}, {1, 2}}},
        kSteps{{{1, 0}, {0, 1}, {-1, 0}, {0, -1}}};
    SplineGrid grid(mesh, sectors);
    for (std::uint32_t c = 0; c < 4; ++c) {
        grid.place(c, kCorners[c], kSteps[c], 4, [](const GridPlace& s) { return GridPlace{-s[1], s[0]}; });
    }
    // First what lies beyond the left and right edge, then below and above, for which all columns are needed.
    for (const int axis : {0, 1}) {
        for (const auto& [missing, near, far] : {std::array{0, 1, 2}, std::array{3, 2, 1}}) {
            for (int along = 0; along < 4; ++along) {
                const auto at = [&, axis = axis, along](int across) {
                    return axis == 0 ? GridPlace{across, along} : GridPlace{along, across};
                };
                if (grid.has(at(missing)) || !grid.has(at(near)) || !grid.has(at(far))) continue;
                grid.points[at(missing)] = combination({{2, &grid.points[at(near)]}, {-1, &grid.points[at(far)]}});
            }
        }
    }
    SparseRows rows;
    for (int y = 0; y < 4; ++y) {
        for (int x = 0; x < 4; ++x) append(rows, grid.points.at({x, y}));
    }
    return rows;
}

SparseRows trianglePatch(const TaggedMesh& mesh, const std::vector<Sector>& sectors) {
    constexpr std::array<GridPlace, 3> kCorners{{{0, 0}, {1, 0}, {0, 1}}}, kSteps{{{1, 0}, {-1, 1}, {0, -1}}};
    const auto turn = [](const GridPlace& s) { return GridPlace{-s[1], s[0] + s[1]}; };
    SplineGrid grid(mesh, sectors);
    for (std::uint32_t c = 0; c < 3; ++c) grid.place(c, kCorners[c], kSteps[c], 6, turn);
    for (std::uint32_t c = 0; c < 3; ++c) {
        const Sector& sector = sectors[c];
        if (sector.closed) continue;
        // The sector's first edge, and all six directions from there on.
        GridPlace step = kSteps[c];
        for (std::size_t k = 0; k < 6 - sector.center; ++k) step = turn(step);
        std::array<PointSum*, 6> ring{};
        std::array<bool, 6> isThere{};
        for (std::size_t k = 0; k < 6; ++k, step = turn(step)) {
            isThere[k] = grid.has(plus(kCorners[c], step));
            ring[k] = &grid.points[plus(kCorners[c], step)];
        }
        const PointSum& v = grid.points[kCorners[c]];
        const std::size_t last = sector.faces.size();  // the sector's last edge
        if (!isThere[last + 1]) *ring[last + 1] = combination({{1, &v}, {1, ring[last]}, {-1, ring[last - 1]}});
        if (!isThere[5]) *ring[5] = combination({{1, &v}, {1, ring[0]}, {-1, ring[1]}});
        for (std::size_t k = last + 2; k < 5; ++k) {
            if (!isThere[k]) *ring[k] = combination({{2, &v}, {-1, ring[k - 3]}});
        }
    }
    SparseRows rows;
    for (const GridPlace& place : kBoxSplinePoints) append(rows, grid.points.at(place));
    return rows;
}

/// Of the 24ths of a Bézier point (i, j) of the box spline: by how many steps a point lies from the triangle's corners.
class BoxSplineTable {
public:
    BoxSplineTable() {
        for (int corner = 0; corner < 3; ++corner) {
            // Along with the corner: its neighbours on the triangle, b and c, and the points across the edges.
            const GridPlace a = kCorner[static_cast<std::size_t>(corner)],
                            b = kCorner[static_cast<std::size_t>((corner + 1) % 3)],
                            c = kCorner[static_cast<std::size_t>((corner + 2) % 3)];
            const auto beyond = [](const GridPlace& p, const GridPlace& q, const GridPlace& r) {
                return GridPlace{p[0] + q[0] - r[0], p[1] + q[1] - r[1]};
            };
            const GridPlace acrossAb = beyond(a, b, c), acrossAc = beyond(a, c, b), awayB = beyond(a, a, b),
                            awayC = beyond(a, a, c);
            set(a, 4, b, 0, {{a, 12}, {b, 2}, {c, 2}, {acrossAb, 2}, {acrossAc, 2}, {awayB, 2}, {awayC, 2}});
            set(a, 3, b, 1, {{a, 12}, {b, 4}, {c, 3}, {acrossAb, 3}, {acrossAc, 1}, {awayC, 1}});
            set(a, 3, c, 1, {{a, 12}, {c, 4}, {b, 3}, {acrossAc, 3}, {acrossAb, 1}, {awayB, 1}});
            set(a, 2, b, 2, {{a, 8}, {b, 8}, {c, 4}, {acrossAb, 4}});
            set(a, 2, b, 1, {{a, 10}, {b, 6}, {c, 6}, {acrossAb, 1}, {acrossAc, 1}});
        }
    }
    std::array<std::array<double, 12>, 15> weights{};

private:
    static constexpr std::array<GridPlace, 3> kCorner{{{0, 0}, {1, 0}, {0, 1}}};
    /// Of the Bézier point of `na` times corner a, `nb` times corner b, and for the rest the third corner.
    void set(const GridPlace& a, int na, const GridPlace& b, int nb,
             std::initializer_list<std::pair<GridPlace, double>> values) {
        const int rest = 4 - na - nb;
        const GridPlace third{1 - a[0] - b[0], 1 - a[1] - b[1]};
        const std::size_t index =
            BezierTriangle::index(4, na * a[0] + nb * b[0] + rest * third[0], na * a[1] + nb * b[1] + rest * third[1]);
        weights[index].fill(0);
        for (const auto& [place, value] : values) {
            const auto found = std::find(kBoxSplinePoints.begin(), kBoxSplinePoints.end(), place);
            weights[index][static_cast<std::size_t>(found - kBoxSplinePoints.begin())] = value / 24;
        }
    }
};

}  // namespace

std::optional<SparseRows> regularPatchOf(const TaggedMesh& mesh, SubdivisionScheme scheme) {
    const std::uint32_t size = scheme == SubdivisionScheme::kLoop ? 3 : 4;
    if (mesh.faceSize(0) != size) return std::nullopt;
    std::vector<Sector> sectors;
    for (std::uint32_t c = 0; c < size; ++c) sectors.push_back(sectorOf(mesh, 0, c));
    if (!isRegular(mesh, size, sectors)) return std::nullopt;
    return size == 4 ? quadrilateralPatch(mesh, sectors) : trianglePatch(mesh, sectors);
}

std::array<Vec3d, 16> bezierOfSpline(const std::array<Vec3d, 16>& points) {
    // A cubic B-spline's Bézier points: (1 4 1)/6, (4 2)/6, (2 4)/6, (1 4 1)/6.
    const auto along = [](const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d) {
        return std::array<Vec3d, 4>{(a + 4 * b + c) / 6, (2 * b + c) / 3, (b + 2 * c) / 3, (b + 4 * c + d) / 6};
    };
    std::array<Vec3d, 16> out;
    for (std::size_t y = 0; y < 4; ++y) {
        const auto row = along(points[4 * y], points[4 * y + 1], points[4 * y + 2], points[4 * y + 3]);
        std::copy(row.begin(), row.end(), out.begin() + static_cast<std::ptrdiff_t>(4 * y));
    }
    for (std::size_t x = 0; x < 4; ++x) {
        const auto column = along(out[x], out[x + 4], out[x + 8], out[x + 12]);
        for (std::size_t y = 0; y < 4; ++y) out[x + 4 * y] = column[y];
    }
    return out;
}

std::array<Vec3d, 15> bezierOfBoxSpline(const std::array<Vec3d, 12>& points) {
    static const BoxSplineTable table;
    std::array<Vec3d, 15> out;
    for (std::size_t i = 0; i < 15; ++i) {
        out[i] = Vec3d::Zero();
        for (std::size_t k = 0; k < 12; ++k) out[i] += table.weights[i][k] * points[k];
    }
    return out;
}

}  // namespace tessera
