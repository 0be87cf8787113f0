#include "common/freeform/subdivision/LimitTessellation.h"

#include <immintrin.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "common/freeform/subdivision/SampleTables.h"

namespace tessera {

namespace {

Vec3d pointAt(std::span<const float> points, std::uint32_t i) {
    return {points[3 * i], points[3 * i + 1], points[3 * i + 2]};
}

void store(std::span<float> to, std::uint32_t vertex, const Vec3d& value) {
    for (int k = 0; k < 3; ++k) to[3 * vertex + static_cast<std::uint32_t>(k)] = static_cast<float>(value[k]);
}

/// Of the triangles of a grid beside a sample. `pointOf`: of a sample (i, j).
template <typename PointOf>
Vec3d normalOfFan(PointOf&& pointOf, std::size_t i, std::size_t j, std::size_t n, bool triangular) {
    static constexpr std::array<std::array<int, 2>, 8> kAround{
        {{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}}};
    static constexpr std::array<std::array<int, 2>, 6> kAroundTriangular{
        {{1, 0}, {0, 1}, {-1, 1}, {-1, 0}, {0, -1}, {1, -1}}};
    const std::span<const std::array<int, 2>> around = triangular
                                                           ? std::span<const std::array<int, 2>>(kAroundTriangular)
                                                           : std::span<const std::array<int, 2>>(kAround);
    const Vec3d here = pointOf(i, j);
    const auto spoke = [&](std::size_t k) -> std::optional<Vec3d> {
        const long x = static_cast<long>(i) + around[k][0], y = static_cast<long>(j) + around[k][1],
                   most = static_cast<long>(n);
        if (x < 0 || y < 0 || x > most || y > most || (triangular && x + y > most)) return std::nullopt;
        return Vec3d(pointOf(static_cast<std::size_t>(x), static_cast<std::size_t>(y)) - here);
    };
    Vec3d sum = Vec3d::Zero();
    for (std::size_t k = 0; k < around.size(); ++k) {
        const auto a = spoke(k), b = spoke((k + 1) % around.size());
        if (a && b) sum += a->cross(*b);
    }
    const double length = sum.norm();
    return length > 0 && std::isfinite(1 / length) ? Vec3d(sum / length) : Vec3d::UnitZ();
}

}  // namespace

std::size_t LimitTessellation::bytes() const {
    return indices_.size() * 4 + faces_.size() * sizeof(Face) + owned_.size() * sizeof(Owned) +
           extras_.size() * sizeof(Extra) + copies_.size() * sizeof(Copy);
}

void LimitTessellation::evaluate(std::span<const float> points, std::span<float> positions,
                                 std::span<float> normals) const {
    TESSERA_CHECK(points.size() == 3 * topology().controlPointCount() && positions.size() == 3 * vertexCount_ &&
                      normals.size() == positions.size(),
                  "arrays of a tessellation have its sizes");
    Scratch scratch;
    for (std::size_t p = 0; p < faces_.size(); ++p) evaluateFace(p, points, scratch, positions, normals);
    copyPositions(positions);
}

LimitTessellation::Range LimitTessellation::update(std::span<const std::uint32_t> moved, std::span<const float> points,
                                                   std::span<float> positions, std::span<float> normals) const {
    TESSERA_CHECK(points.size() == 3 * topology().controlPointCount() && positions.size() == 3 * vertexCount_ &&
                      normals.size() == positions.size(),
                  "arrays of a tessellation have its sizes");
    Scratch scratch;
    Range range{vertexCount_, 0};
    const auto include = [&range](std::size_t vertex) {
        range.begin = std::min(range.begin, vertex);
        range.end = std::max(range.end, vertex + 1);
    };
    for (const std::uint32_t p : topology().touchedBy(moved)) {
        const Face& face = faces_[p];
        evaluateFace(p, points, scratch, positions, normals);
        for (std::uint32_t i = face.ownedBegin; i < face.ownedEnd; ++i) include(owned_[i].vertex);
        for (std::uint32_t i = face.extrasBegin; i < face.extrasEnd; ++i) include(extras_[i].vertex);
    }
    for (const Copy& copy : copies_) {
        if (std::equal(&positions[3 * copy.to], &positions[3 * copy.to] + 3, &positions[3 * copy.from])) continue;
        include(copy.to);
        std::copy_n(&positions[3 * copy.from], 3, &positions[3 * copy.to]);
    }
    return range.begin < range.end ? range : Range{};
}

void LimitTessellation::copyPositions(std::span<float> positions) const {
    for (const Copy& copy : copies_) std::copy_n(&positions[3 * copy.from], 3, &positions[3 * copy.to]);
}

namespace {

/// Three rows of weights by points: x and y side by side, which SSE2 has and so every x86-64. The same sums in the same
/// order as one by one.
std::array<Vec3d, 3> threeSums(const double* weights, std::span<const Vec3d> points) {
    const std::size_t count = points.size();
    __m128d xy[3] = {_mm_setzero_pd(), _mm_setzero_pd(), _mm_setzero_pd()},
            z[3] = {_mm_setzero_pd(), _mm_setzero_pd(), _mm_setzero_pd()};
    for (std::size_t i = 0; i < count; ++i) {
        const __m128d pxy = _mm_loadu_pd(points[i].data()), pz = _mm_load_sd(points[i].data() + 2);
        for (std::size_t row = 0; row < 3; ++row) {
            const __m128d weight = _mm_set1_pd(weights[row * count + i]);
            xy[row] = _mm_add_pd(xy[row], _mm_mul_pd(weight, pxy));
            z[row] = _mm_add_sd(z[row], _mm_mul_sd(weight, pz));
        }
    }
    std::array<Vec3d, 3> sums;
    for (std::size_t row = 0; row < 3; ++row) {
        _mm_storeu_pd(sums[row].data(), xy[row]);
        _mm_store_sd(sums[row].data() + 2, z[row]);
    }
    return sums;
}

}  // namespace

/// Points of one face, about its first control point: so what is far from the origin loses nothing.
class LimitTessellation::FaceSums {
public:
    struct Sample {
        Vec3d point, normal;  ///< zero: there is no tangent plane
    };
    FaceSums(const LimitPlan& plan, const LimitPlan::Face& face, std::span<const float> points, Scratch& scratch) {
        const std::span<const std::uint32_t> named = plan.pointsOf(face);
        scratch.points.resize(named.size());
        for (std::size_t i = 0; i < named.size(); ++i) scratch.points[i] = pointAt(points, named[i]);
        origin_ = scratch.points[0];
        for (Vec3d& p : scratch.points) p -= origin_;
        base_ = scratch.points;
        if (!face.spline) return;
        face.spline->apply(scratch.points, scratch.spline);
        base_ = scratch.spline;
    }
    [[nodiscard]] const Vec3d& origin() const { return origin_; }
    [[nodiscard]] Sample byTable(const LimitPlan::Table& table, std::size_t sample) const {
        const std::array<Vec3d, 3> sums = threeSums(table.weights.data() + sample * 3 * base_.size(), base_);
        return sampleOf(sums[0], sums[1], sums[2]);
    }
    /// `j`, the number of v's row: rows are kept from one to the next.
    [[nodiscard]] Sample byProduct(const CubicSplineBasis& u, const CubicSplineBasis& v, std::size_t j) {
        if (j != row_) {
            row_ = j;
            for (std::size_t x = 0; x < 4; ++x) {
                across_[x] = v.value[0] * base_[x] + v.value[1] * base_[4 + x] + v.value[2] * base_[8 + x] +
                             v.value[3] * base_[12 + x];
                slope_[x] = v.slope[0] * base_[x] + v.slope[1] * base_[4 + x] + v.slope[2] * base_[8 + x] +
                            v.slope[3] * base_[12 + x];
            }
        }
        return sampleOf(
            u.value[0] * across_[0] + u.value[1] * across_[1] + u.value[2] * across_[2] + u.value[3] * across_[3],
            u.slope[0] * across_[0] + u.slope[1] * across_[1] + u.slope[2] * across_[2] + u.slope[3] * across_[3],
            u.value[0] * slope_[0] + u.value[1] * slope_[1] + u.value[2] * slope_[2] + u.value[3] * slope_[3]);
    }

private:
    static Sample sampleOf(const Vec3d& point, const Vec3d& du, const Vec3d& dv) {
        const Vec3d across = du.cross(dv);
        const double area = across.squaredNorm();
        // As LimitEvaluator has it: below this there is no tangent plane.
        return {point,
                area > 1e-24 * du.squaredNorm() * dv.squaredNorm() ? Vec3d(across / std::sqrt(area)) : Vec3d::Zero()};
    }

    Vec3d origin_;
    std::span<const Vec3d> base_;
    std::size_t row_ = ~std::size_t{0};
    std::array<Vec3d, 4> across_, slope_;
};

void LimitTessellation::evaluateFace(std::size_t ptex, std::span<const float> points, Scratch& scratch,
                                     std::span<float> positions, std::span<float> normals) const {
    const Face& face = faces_[ptex];
    if (face.ownedBegin == face.ownedEnd && face.extrasBegin == face.extrasEnd) return;
    const std::size_t n = face.segments;
    const bool triangular = plan_->triangular();
    FaceSums sums(*plan_, plan_->faces()[ptex], points, scratch);
    std::vector<CubicSplineBasis>& bases = scratch.bases;
    if (!face.table && bases.size() != n + 1) {
        bases.clear();
        for (std::size_t i = 0; i <= n; ++i) bases.emplace_back(static_cast<double>(i) / static_cast<double>(n));
    }
    const auto keep = [&](std::uint32_t vertex, const FaceSums::Sample& sample, std::size_t i, std::size_t j,
                          std::size_t segments, auto&& pointOf) {
        store(positions, vertex, sample.point + sums.origin());
        // What neighbours own they evaluate; but a normal that is missing is made of all that is around it.
        store(normals, vertex,
              sample.normal.isZero(0) ? normalOfFan(pointOf, i, j, segments, triangular) : sample.normal);
    };
    const auto ofGrid = [&](std::size_t sample, std::size_t i, std::size_t j) {
        return face.table ? sums.byTable(*face.table, sample) : sums.byProduct(bases[i], bases[j], j);
    };
    for (std::uint32_t o = face.ownedBegin; o < face.ownedEnd; ++o) {
        std::size_t i = owned_[o].sample, j = 0;
        if (triangular)
            for (std::size_t width = n + 1; i >= width; ++j, --width) i -= width;
        else
            j = i / (n + 1), i %= n + 1;
        keep(owned_[o].vertex, ofGrid(owned_[o].sample, i, j), i, j, n,
             [&](std::size_t x, std::size_t y) { return ofGrid(gridSample(x, y, n, triangular), x, y).point; });
    }
    for (std::uint32_t e = face.extrasBegin; e < face.extrasEnd; ++e) {
        const Extra& extra = extras_[e];
        const std::size_t m = std::size_t{1} << extra.log2Segments;
        const auto at = [&](std::size_t x, std::size_t y) {
            if (extra.table) return sums.byTable(*extra.table, gridSample(x, y, m, triangular));
            // No row of the grid's own: they do not meet.
            return sums.byProduct(CubicSplineBasis(static_cast<double>(x) / static_cast<double>(m)),
                                  CubicSplineBasis(static_cast<double>(y) / static_cast<double>(m)),
                                  (n + 1) + (m + 1) * extra.log2Segments + y);
        };
        keep(extra.vertex, at(extra.i, extra.j), extra.i, extra.j, m,
             [&](std::size_t x, std::size_t y) { return at(x, y).point; });
    }
}

}  // namespace tessera
