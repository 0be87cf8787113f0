/// The sphere in triangles: an octahedron whose faces are split into four at the middles of their edges, once or more.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "common/math/Types.h"
#include "server/collision/spherical_bezier/SphericalTriangle.h"

namespace tessera {

/// Where a direction is, and how far at least from the edges of its triangle: the sine of the angle.
struct SpherePlace {
    std::uint32_t triangle = 0;
    double margin = 0;
};

/// 8 · 4^levels triangles; of level 2: 128, with 192 edges and 66 vertices. Immutable: any thread.
class SphereLayout {
public:
    static constexpr unsigned kMostLevels = 4;
    /// Levels above kMostLevels are taken for that.
    explicit SphereLayout(unsigned levels);

    [[nodiscard]] unsigned levels() const { return levels_; }
    [[nodiscard]] const std::vector<SphericalTriangle>& triangles() const { return triangles_; }
    /// Points that triangles share: their corners, and the middles of their edges after these. Of a triangle corner 0,
    /// 1, 2, then the middle of the edge opposite to each: where the coefficients of a polynomial of degree 2 are.
    [[nodiscard]] const std::vector<std::array<std::uint32_t, 6>>& points() const { return points_; }
    [[nodiscard]] const std::vector<Vec3d>& directions() const { return directions_; }

    /// Of any vector but zero (which is in some triangle, with a margin of 0).
    [[nodiscard]] SpherePlace locate(const Vec3d& v) const;
    /// Calls `each(triangle)` at least for all whose cones the triangle of these three points meets, seen from the
    /// origin. What is left out lies beyond one of a cone's three planes with all three points, so with every point
    /// between them.
    template <typename Each>
    void visit(const std::array<Vec3d, 3>& points, Each&& each) const {
        for (std::uint32_t octant = 0; octant < 8; ++octant) visitBelow(0, octant, points, marginOf(points), each);
    }
    /// The same where it is known in which triangles the three points are, well inside (SpherePlace::margin): what is
    /// around all three has all that is between them.
    template <typename Each>
    void visit(const std::array<Vec3d, 3>& points, std::array<std::uint32_t, 3> triangles, Each&& each) const {
        for (unsigned level = levels_ + 1; level-- > 0;) {
            if (triangles[0] == triangles[1] && triangles[1] == triangles[2]) {
                visitBelow(level, triangles[0], points, marginOf(points), each);
                return;
            }
            for (std::uint32_t& t : triangles) t /= 4;
        }
        visit(points, each);
    }

private:
    struct Node {
        std::array<Vec3d, 3> inwards;  ///< unit normals of the cone's sides
        std::array<Vec3d, 3> cuts;     ///< of the inner part's sides, towards the corners
    };

    /// A thousand times what rounding can do to a product with a unit vector.
    [[nodiscard]] static double marginOf(const std::array<Vec3d, 3>& points) {
        return 1e-12 * std::max({points[0].cwiseAbs().maxCoeff(), points[1].cwiseAbs().maxCoeff(),
                                 points[2].cwiseAbs().maxCoeff()});
    }
    template <typename Each>
    void visitBelow(unsigned level, std::uint32_t triangle, const std::array<Vec3d, 3>& points, double margin,
                    Each& each) const {
        for (const Vec3d& inwards : nodes_[level][triangle].inwards)
            if (inwards.dot(points[0]) < -margin && inwards.dot(points[1]) < -margin &&
                inwards.dot(points[2]) < -margin)
                return;
        if (level == levels_) {
            each(triangle);
            return;
        }
        for (std::uint32_t part = 0; part < 4; ++part) visitBelow(level + 1, 4 * triangle + part, points, margin, each);
    }

    unsigned levels_;
    std::vector<std::vector<Node>> nodes_;  ///< per level; the parts of triangle t are 4 t to 4 t + 3
    std::vector<SphericalTriangle> triangles_;
    std::vector<std::array<std::uint32_t, 6>> points_;
    std::vector<Vec3d> directions_;
};

}  // namespace tessera
