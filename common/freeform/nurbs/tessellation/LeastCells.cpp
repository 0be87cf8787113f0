#include "common/freeform/nurbs/tessellation/LeastCells.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace tessera {
namespace {

/// What second derivatives along an axis are over [0, 1]², at least: their coefficients, less what weights may take of
/// them.
class Bends {
public:
    Bends(const BezierPatch& patch, PatchAxis axis) {
        const bool alongU = axis == PatchAxis::kU;
        const int n = alongU ? patch.degreeU : patch.degreeV, rows = alongU ? patch.degreeV : patch.degreeU;
        if (n < 2) return;
        const Vec4d& first = patch.at(0, 0);
        const Vec3d origin = first.head<3>() / first.w();
        const auto at = [&](int i, int row) -> Vec4d {
            Vec4d moved = alongU ? patch.at(i, row) : patch.at(row, i);
            moved.head<3>() -= moved.w() * origin;
            return moved;
        };
        double reach = 0, leastWeight = std::numeric_limits<double>::infinity();
        double slope = 0, slopeOfWeight = 0, bendOfWeight = 0;
        for (int row = 0; row <= rows; ++row)
            for (int i = 0; i <= n; ++i) {
                const Vec4d p = at(i, row);
                reach = std::max(reach, p.head<3>().norm() / p.w());
                leastWeight = std::min(leastWeight, p.w());
                mostWeight_ = std::max(mostWeight_, p.w());
                if (i < n) {
                    const Vec4d step = n * (at(i + 1, row) - p);
                    slope = std::max(slope, step.head<3>().norm());
                    slopeOfWeight = std::max(slopeOfWeight, std::abs(step.w()));
                }
                if (i + 1 < n) {
                    const Vec4d bend = n * (n - 1) * (at(i + 2, row) - 2 * at(i + 1, row) + p);
                    coefficients_.emplace_back(bend.head<3>());
                    sum_ += coefficients_.back();
                    bendOfWeight = std::max(bendOfWeight, std::abs(bend.w()));
                }
            }
        // S = N / w: w S'' = N'' − 2 w' S' − w'' S, and w S' = N' − w' S. And what rounding may make of differences of
        // control points.
        const double slopeOfS = (slope + slopeOfWeight * reach) / leastWeight;
        less_ = 2 * slopeOfWeight * slopeOfS + bendOfWeight * reach +
                64 * std::numeric_limits<double>::epsilon() * n * n * (origin.norm() + reach) * mostWeight_;
    }

    [[nodiscard]] const Vec3d& sum() const { return sum_; }
    /// Along a direction of length 1; 0: not known.
    [[nodiscard]] double leastAlong(const Vec3d& direction) const {
        if (coefficients_.empty()) return 0;
        double least = std::numeric_limits<double>::infinity();
        for (const Vec3d& bend : coefficients_) least = std::min(least, direction.dot(bend));
        least -= less_;
        return least > 0 ? least / mostWeight_ : 0;
    }

private:
    std::vector<Vec3d> coefficients_;
    Vec3d sum_ = Vec3d::Zero();
    double less_ = 0, mostWeight_ = 0;
};

/// How many flat cells lie within a rectangle, at least.
struct CellsWithin {
    double cells = 0, alongU = 0, alongV = 0;
};
CellsWithin cellsWithin(const BezierPatch& patch, double tolerance) {
    const Bends bendsU(patch, PatchAxis::kU), bendsV(patch, PatchAxis::kV);
    const auto along = [](const Bends& bends, const Vec3d& direction) {
        return direction.norm() > 0 ? bends.leastAlong(direction.normalized()) : 0.0;
    };
    const double ownU = along(bendsU, bendsU.sum()), ownV = along(bendsV, bendsV.sum());
    // A cell that leaves the rectangle is in it no wider, and no higher, than this: it covers no more than a rim.
    const auto widest = [&](double least) {
        return least > 0 ? std::sqrt(8 * tolerance / least) : std::numeric_limits<double>::infinity();
    };
    const double width = widest(ownU), height = widest(ownV);
    CellsWithin out;
    if (2 * width < 1) out.alongU = (1 - 2 * width) / std::sqrt(4 * tolerance / ownU);
    if (2 * height < 1) out.alongV = (1 - 2 * height) / std::sqrt(4 * tolerance / ownV);
    const double inner = (1 - 2 * width) * (1 - 2 * height);
    if (!(2 * width < 1 && 2 * height < 1)) return out;
    // Off by an eighth of each axis's second derivative: by the larger, or, where both bend to one side, by both. The
    // area that this leaves:
    double area = 4 * tolerance / std::sqrt(ownU * ownV);
    const Vec3d side = bendsU.sum().normalized() + bendsV.sum().normalized();
    const double sideU = along(bendsU, side), sideV = along(bendsV, side);
    if (sideU > 0 && sideV > 0) area = std::min(area, 2 * tolerance / std::sqrt(sideU * sideV));
    out.cells = inner / area;
    return out;
}

/// As powers of two, so that all rectangles of a row of spans are in the same rows.
int dividedBy(std::size_t spans) {
    constexpr std::size_t kMostRectangles = 4'096;
    int divided = 8;
    while (divided > 1 && spans * static_cast<std::size_t>(divided * divided) > kMostRectangles) divided /= 2;
    return divided;
}

}  // namespace

double leastCells(const NurbsSurface& surface, const LatticeSurface& lattice, double tolerance) {
    const int divided = dividedBy(lattice.u.spans() * lattice.v.spans());
    const bool isTrimmed = !surface.region().loops().empty();
    double cells = 0;
    std::vector<double> alongRow(lattice.v.spans() * static_cast<std::size_t>(divided), 0),
        alongColumn(lattice.u.spans() * static_cast<std::size_t>(divided), 0);
    for (std::size_t j = 0; j < lattice.v.spans(); ++j)
        for (std::size_t i = 0; i < lattice.u.spans(); ++i) {
            BezierPatch row = lattice.patch(i, j);
            for (int y = 0; y < divided; ++y) {
                BezierPatch rest;
                if (y + 1 < divided) {
                    auto parts = split(row, PatchAxis::kV, 1.0 / (divided - y));
                    rest = std::move(parts[1]);
                    row = std::move(parts[0]);
                }
                BezierPatch part = std::move(row);
                row = std::move(rest);
                for (int x = 0; x < divided; ++x) {
                    BezierPatch right;
                    if (x + 1 < divided) {
                        auto parts = split(part, PatchAxis::kU, 1.0 / (divided - x));
                        right = std::move(parts[1]);
                        part = std::move(parts[0]);
                    }
                    const BezierPatch here = std::move(part);
                    part = std::move(right);
                    if (isTrimmed) {
                        const auto parameter = [&](const ParameterAxis& axis, std::size_t span, int k) {
                            return axis.toParameter(static_cast<std::int64_t>(span) * kLatticeSpan +
                                                    kLatticeSpan / divided * k);
                        };
                        const ParameterRectangle over{{parameter(lattice.u, i, x), parameter(lattice.u, i, x + 1)},
                                                      {parameter(lattice.v, j, y), parameter(lattice.v, j, y + 1)}};
                        if (surface.region().side(over) != RectangleSide::kKept) continue;
                    }
                    const CellsWithin within = cellsWithin(here, tolerance);
                    cells += within.cells;
                    alongRow[j * static_cast<std::size_t>(divided) + static_cast<std::size_t>(y)] += within.alongU;
                    alongColumn[i * static_cast<std::size_t>(divided) + static_cast<std::size_t>(x)] += within.alongV;
                }
            }
        }
    return std::max({cells, *std::max_element(alongRow.begin(), alongRow.end()),
                     *std::max_element(alongColumn.begin(), alongColumn.end())});
}

}  // namespace tessera
