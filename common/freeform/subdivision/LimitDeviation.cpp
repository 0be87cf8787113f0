// How far triangles are from the limit surface, as the vertices of finer ones tell.
//
// Cells of one level lie within those of the level before, each triangle in four, so the distance to the surface is at most the sum over the
// levels of how far each puts new vertices beside the triangles before it (the triangle inequality; a point of a triangle is no farther from
// another one than its corners are). What has been evaluated is measured, what comes after it is a geometric series.
#include <algorithm>
#include <array>
#include <cmath>

#include "common/freeform/subdivision/LimitTessellation.h"

namespace tessera {
namespace {

/// Where a polynomial's second derivatives fall off to nothing in the middle of what was measured, the quarters beside it bend twice as much as
/// measured halves say; then a quarter of that at each level.
constexpr double kBeyondOfPolynomials = 2 * (1.0 / 3);
/// Beside an irregular vertex a level's share of the one before is about 0.35 with five edges, and nears 0.65 with ever more.
double beyondOfIrregular(std::uint32_t edges) { return edges <= 6 ? 0.8 : edges <= 9 ? 1.2 : 1.9; }
/// A crease of sharpness s is smooth only beyond level s.
constexpr double kBeyondOfCreases = 3;

Vec3d vertexAt(std::span<const float> numbers, std::uint32_t vertex) {
    return {numbers[3 * std::size_t{vertex}], numbers[3 * std::size_t{vertex} + 1], numbers[3 * std::size_t{vertex} + 2]};
}

/// The vertices of one face's grid, as its triangles name them.
struct FaceGrid {
    std::span<const std::uint32_t> indices;
    std::uint32_t n = 1;
    bool triangular = false;

    [[nodiscard]] std::uint32_t at(std::uint32_t i, std::uint32_t j) const {
        const std::size_t width = n;
        if (triangular) {
            // A row has n - j triangles upwards, and one less the other way between them.
            const auto upward = [&](std::size_t x, std::size_t y) { return 3 * (y * (2 * width - y) + 2 * x); };
            if (i + j < n) return indices[upward(i, j)];
            return j > 0 ? indices[upward(i, j - 1) + 2] : indices[upward(i - 1, 0) + 1];
        }
        const auto cell = [&](std::size_t x, std::size_t y) { return 6 * (y * width + x); };
        if (i < n && j < n) return indices[cell(i, j)];
        if (j < n) return indices[cell(i - 1, j) + 1];
        return i > 0 ? indices[cell(i - 1, j - 1) + 2] : indices[cell(0, j - 1) + 5];
    }
};

}  // namespace

double LimitTessellation::deviation(std::span<const float> positions, std::span<const float> normals, int coarser) const {
    TESSERA_CHECK(coarser <= level_ && level_ >= 2, "what is coarser is measured by what is finer");
    double most = 0;
    std::size_t begin = 0;
    for (std::size_t p = 0; p < faces_.size(); ++p) {
        const PtexFace ptex = topology_.ptexFace(p);
        if (!topology_.hasSurface(ptex.face)) continue;
        const Face& face = faces_[p];
        const std::uint32_t n = face.segments;
        const std::size_t count = 3 * (triangular() ? std::size_t{n} * n : 2 * std::size_t{n} * n);
        const FaceGrid grid{std::span(indices_).subspan(begin, count), n, triangular()};
        begin += count;
        const auto beside = [&](std::array<std::uint32_t, 2> a, std::array<std::uint32_t, 2> b) {
            const std::uint32_t middle = grid.at((a[0] + b[0]) / 2, (a[1] + b[1]) / 2);
            const Vec3d from = vertexAt(positions, grid.at(a[0], a[1])), along = vertexAt(positions, grid.at(b[0], b[1])) - from;
            const Vec3d off = vertexAt(positions, middle) - from - 0.5 * along;
            const bool onSide[4] = {a[1] == 0 && b[1] == 0, triangular() ? a[0] + a[1] == n && b[0] + b[1] == n : a[0] == n && b[0] == n,
                                    !triangular() && a[1] == n && b[1] == n, a[0] == 0 && b[0] == 0};
            bool rim = false;
            for (unsigned side = 0; side < 4; ++side) rim = rim || (onSide[side] && (face.rims >> side & 1));
            if (!rim) return std::abs(off.dot(vertexAt(normals, middle)));
            const double length2 = along.squaredNorm();
            return length2 > 0 ? (off - off.dot(along) / length2 * along).norm() : off.norm();
        };
        double sum = 0, last = 0;
        for (int level = std::min(coarser, level_ - 1); level < level_; ++level) {
            const std::uint32_t step = 1U << (level_ - level);
            // Polygons' parts have half as many segments.
            if (step > n) continue;
            last = 0;
            for (std::uint32_t j = 0; j <= n; j += step) {
                for (std::uint32_t i = 0; i + (triangular() ? j : 0) <= n; i += step) {
                    const bool right = i + step + (triangular() ? j : 0) <= n, up = j + step + (triangular() ? i : 0) <= n;
                    if (right) last = std::max(last, beside({i, j}, {i + step, j}));
                    if (up) last = std::max(last, beside({i, j}, {i, j + step}));
                    if (triangular() && right && up) last = std::max(last, beside({i + step, j}, {i, j + step}));
                    if (!triangular() && right && up) last = std::max(last, beside({i, j}, {i + step, j + step}));
                }
            }
            if (level >= coarser) sum += last;
        }
        const bool rounded = face.sharpest > static_cast<float>(level_);
        most = std::max(most, sum + last * (rounded ? kBeyondOfCreases : face.spline ? kBeyondOfPolynomials : beyondOfIrregular(face.most)));
    }
    return most;
}

}  // namespace tessera
