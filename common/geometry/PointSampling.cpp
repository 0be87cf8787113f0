// How far apart points are, and points on surfaces.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/geometry/Points.h"

namespace tessera {

namespace {

/// Points in the order of one coordinate: the neighbours of one are looked for from it outwards, as far as that alone
/// does not keep them further away than the nearest so far.
class SortedPoints {
public:
    SortedPoints(std::span<const float> positions, int axis)
        : positions_(positions), axis_(static_cast<std::size_t>(axis)) {
        for (std::size_t i = 0; i < positions.size() / 3; ++i)
            if (at(i).allFinite()) order_.emplace_back(positions[3 * i + axis_], static_cast<std::uint32_t>(i));
        std::sort(order_.begin(), order_.end());
    }
    [[nodiscard]] std::size_t size() const { return order_.size(); }

    /// The distance from the point at a rank to the nearest in another place; infinite where none was met.
    [[nodiscard]] double nearest(std::size_t rank) const {
        // So that a million points in one place cost no more than others.
        constexpr std::size_t kMostLooks = 50'000;
        const Vec3d here = at(order_[rank].second);
        double best = std::numeric_limits<double>::infinity();  // squared
        std::size_t looks = 0;
        const auto look = [&](std::size_t other) {
            const double along = double{order_[other].first} - here[static_cast<int>(axis_)];
            if (along * along >= best || ++looks > kMostLooks) return false;
            const double distance = (at(order_[other].second) - here).squaredNorm();
            if (distance > 0) best = std::min(best, distance);
            return true;
        };
        std::size_t below = rank, above = rank + 1;
        for (bool down = true, up = true; down || up;) {
            down = down && below > 0 && look(--below);
            up = up && above < order_.size() && look(above++);
        }
        return std::sqrt(best);
    }

private:
    [[nodiscard]] Vec3d at(std::size_t i) const {
        return Vec3d(positions_[3 * i], positions_[3 * i + 1], positions_[3 * i + 2]);
    }

    std::span<const float> positions_;
    std::size_t axis_;
    std::vector<std::pair<float, std::uint32_t>> order_;
};

/// Evenly laid numbers in the unit square (Roberts, The unreasonable effectiveness of quasirandom sequences, 2018: R2).
Vec2d evenlyLaid(std::size_t k) {
    constexpr double kPlastic = 1.32471795724474602596;
    const auto fraction = [](double x) { return x - std::floor(x); };
    const auto i = static_cast<double>(k);
    return {fraction(0.5 + i / kPlastic), fraction(0.5 + i / (kPlastic * kPlastic))};
}

}  // namespace

double spacingOf(std::span<const float> positions) {
    constexpr std::size_t kSample = 256;
    const Box box = boundsOf(positions);
    if (box.empty()) return 0;
    int longest = 0;
    const double length = box.size().maxCoeff(&longest);
    if (!(length > 0)) return 0;
    const SortedPoints points(positions, longest);
    std::vector<double> distances;
    const std::size_t sample = std::min(kSample, points.size());
    for (std::size_t i = 0; i < sample; ++i)
        if (const double distance = points.nearest((2 * i + 1) * points.size() / (2 * sample)); std::isfinite(distance))
            distances.push_back(distance);
    if (distances.empty()) return 0;
    const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
    std::nth_element(distances.begin(), middle, distances.end());
    return *middle;
}

Expected<MeshData> pointsOnSurface(const MeshData& surface, double spacing, std::size_t maxPoints) {
    const auto vector = [](const std::vector<float>& from, std::uint32_t vertex) {
        return Vec3d(from[3 * vertex], from[3 * vertex + 1], from[3 * vertex + 2]);
    };
    const auto areaOf = [&](std::size_t first) {
        const Vec3d a = vector(surface.positions, surface.indices[first]);
        const Vec3d b = vector(surface.positions, surface.indices[first + 1]);
        const Vec3d c = vector(surface.positions, surface.indices[first + 2]);
        return 0.5 * (b - a).cross(c - a).norm();
    };
    double whole = 0;
    for (std::size_t i = 0; i + 2 < surface.indices.size(); i += 3) whole += areaOf(i);
    const double perPoint = spacing * spacing;
    if (!(whole / perPoint <= static_cast<double>(maxPoints)))
        return fail(ErrorCode::kLimit,
                    fmt::format("{:.0f} points, at most {} are allowed", whole / perPoint, maxPoints));

    MeshData normalled;
    if (surface.normals.empty()) {
        normalled = surface;
        computeNormals(normalled);
    }
    const std::vector<float>& normals = surface.normals.empty() ? normalled.normals : surface.normals;
    MeshData points;
    points.primitive = Primitive::kPoints;
    // The triangles laid end to end by their areas: a point in the middle of every length `perPoint`.
    double passed = 0;
    std::size_t k = 0;
    for (std::size_t i = 0; i + 2 < surface.indices.size(); i += 3) {
        passed += areaOf(i);
        for (; (static_cast<double>(k) + 0.5) * perPoint < passed; ++k) {
            Vec2d share = evenlyLaid(k);
            if (share.sum() > 1) share = Vec2d::Ones() - share;
            const auto mixed = [&](const std::vector<float>& from) -> Vec3d {
                return (1 - share.sum()) * vector(from, surface.indices[i]) +
                       share.x() * vector(from, surface.indices[i + 1]) +
                       share.y() * vector(from, surface.indices[i + 2]);
            };
            const Vec3d place = mixed(surface.positions), normal = mixed(normals).stableNormalized();
            for (int axis = 0; axis < 3; ++axis) {
                points.positions.push_back(static_cast<float>(place[axis]));
                points.normals.push_back(static_cast<float>(normal[axis]));
            }
        }
    }
    return points;
}

}  // namespace tessera
