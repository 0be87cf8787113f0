#include "server/collision/spherical_bezier/SphereLayout.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "server/collision/spherical_bezier/SphericalPatch.h"

namespace tessera {

namespace {

/// The unit normal of the plane through the origin, x and y, towards z.
Vec3d sideTowards(const Vec3d& x, const Vec3d& y, const Vec3d& z) {
    const Vec3d n = x.cross(y).normalized();
    return n.dot(z) < 0 ? Vec3d(-n) : n;
}

}  // namespace

SphereLayout::SphereLayout(unsigned levels) : levels_(std::min(levels, kMostLevels)) {
    for (unsigned octant = 0; octant < 8; ++octant) {
        const auto sign = [&](unsigned bit) { return (octant >> bit & 1U) != 0 ? -1.0 : 1.0; };
        triangles_.push_back(
            SphericalTriangle::make({sign(0) * Vec3d::UnitX(), sign(1) * Vec3d::UnitY(), sign(2) * Vec3d::UnitZ()})
                .value());
    }
    for (unsigned level = 0;; ++level) {
        std::vector<Node>& nodes = nodes_.emplace_back();
        std::vector<SphericalTriangle> parts;
        for (const SphericalTriangle& t : triangles_) {
            const std::array<SphericalTriangle, 4> four = splitAtEdges(t);
            Node& node = nodes.emplace_back();
            for (std::size_t i = 0; i < 3; ++i) {
                node.inwards[i] = sideTowards(t.corner((i + 1) % 3), t.corner((i + 2) % 3), t.corner(i));
                // The inner part's corner i is the middle of the edge opposite to corner i.
                node.cuts[i] = sideTowards(four[3].corner((i + 1) % 3), four[3].corner((i + 2) % 3), t.corner(i));
            }
            parts.insert(parts.end(), four.begin(), four.end());
        }
        if (level == levels_) break;
        triangles_ = std::move(parts);
    }

    // Corners that are the same come out within rounding of each other; the grid is far coarser than that and far finer
    // than a triangle. Coordinates lie nowhere near the middle between two of its lines but by ill luck, which the test
    // would show.
    std::map<std::array<long, 3>, std::uint32_t> byPlace;
    const auto point = [&](const Vec3d& direction) {
        std::array<long, 3> key{};
        for (int k = 0; k < 3; ++k) key[static_cast<std::size_t>(k)] = std::lround(direction[k] * 1e6);
        const auto [at, fresh] = byPlace.try_emplace(key, static_cast<std::uint32_t>(directions_.size()));
        if (fresh) directions_.push_back(direction);
        return at->second;
    };
    points_.resize(triangles_.size());
    for (std::size_t t = 0; t < triangles_.size(); ++t)
        for (std::size_t i = 0; i < 3; ++i) points_[t][i] = point(triangles_[t].corner(i));
    for (std::size_t t = 0; t < triangles_.size(); ++t)
        for (std::size_t i = 0; i < 3; ++i)
            points_[t][3 + i] =
                point((triangles_[t].corner((i + 1) % 3) + triangles_[t].corner((i + 2) % 3)).normalized());
}

SpherePlace SphereLayout::locate(const Vec3d& v) const {
    const double length = v.norm();
    SpherePlace place;
    place.margin = v.cwiseAbs().minCoeff();
    for (unsigned k = 0; k < 3; ++k) place.triangle |= (v[k] < 0 ? 1U : 0U) << k;
    // Every side of a triangle is one of its octant's or a cut on the way down, so the least of all distances holds.
    for (unsigned level = 0; level < levels_; ++level) {
        const Node& node = nodes_[level][place.triangle];
        const double d0 = node.cuts[0].dot(v), d1 = node.cuts[1].dot(v), d2 = node.cuts[2].dot(v);
        const std::uint32_t part = d0 > 0 ? 0U : d1 > 0 ? 1U : d2 > 0 ? 2U : 3U;
        place.margin = std::min({place.margin, std::abs(d0), std::abs(d1), std::abs(d2)});
        place.triangle = 4 * place.triangle + part;
    }
    place.margin = length > 0 ? place.margin / length : 0;
    return place;
}

}  // namespace tessera
