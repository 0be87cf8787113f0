/// A convex hull as contacts need it: corners, flat sides with their outlines, edges with the sides they part.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "common/math/Box.h"
#include "server/collision/convex/ConvexHull.h"

namespace tessera::rigid {

/// In the hull's own frame; made once per hull. Triangles that lie in one plane, to a ten-thousandth of the hull's
/// size, are one side: a box has six. Affine maps keep planes, so it is valid in every pose.
struct SolidShape {
    struct Edge {
        std::uint32_t from = 0, to = 0;     ///< corners
        std::uint32_t left = 0, right = 0;  ///< sides
    };
    std::vector<Vec3d> corners;
    std::vector<std::uint32_t> firstOfSide;  ///< into `outlines`; one more than there are sides
    std::vector<std::uint32_t> outlines;     ///< corners of each side in turn, counter-clockwise seen from outside
    std::vector<Edge> edges;
    std::vector<std::uint32_t> firstOfCorner;  ///< into `edgesOfCorners`; one more than there are corners
    std::vector<std::uint32_t> edgesOfCorners;
    bool flat = false;  ///< a polygon with two sides

    [[nodiscard]] std::size_t sides() const { return firstOfSide.size() - 1; }
    [[nodiscard]] std::span<const std::uint32_t> edgesOf(std::size_t corner) const {
        return std::span(edgesOfCorners)
            .subspan(firstOfCorner[corner], firstOfCorner[corner + 1] - firstOfCorner[corner]);
    }
    [[nodiscard]] std::span<const std::uint32_t> outline(std::size_t side) const {
        return std::span(outlines).subspan(firstOfSide[side], firstOfSide[side + 1] - firstOfSide[side]);
    }
};

/// Segments and points have no sides: nothing meets them.
[[nodiscard]] SolidShape solidShape(const ConvexHull& hull);

struct PlacedSide {
    Vec3d normal;
    double offset = 0;  ///< of the plane: normal · x
};

/// The normals of the planes through the edge lie on the shorter arc from `first` to `second`.
struct PlacedEdge {
    Vec3d from, along;
    Vec3d first, second, crossed;  ///< crossed: first × second
};

/// In the world, for one frame. Views of memory that the frame owns.
struct PlacedSolid {
    const SolidShape* shape = nullptr;
    std::span<const Vec3d> corners;
    std::span<const PlacedSide> sides;
    std::span<const PlacedEdge> edges;
    Vec3d centre = Vec3d::Zero();  ///< of the corners: inside
    double radius = 0;             ///< no corner is farther from it
    double inner = 0;              ///< no side is nearer to it
    Box box;
    double turn = 1;  ///< -1: mirrored, outlines run the other way round
};

/// How far the lowest of them comes along n.
[[nodiscard]] inline double lowest(std::span<const Vec3d> corners, const Vec3d& n) {
    double least = std::numeric_limits<double>::infinity();
    for (const Vec3d& c : corners) least = std::min(least, n.dot(c));
    return least;
}

/// Room that `place` needs.
[[nodiscard]] inline std::size_t placedEdges(const SolidShape& shape) {
    return shape.edges.size() * (shape.flat ? 2 : 1);
}

[[nodiscard]] PlacedSolid place(const SolidShape& shape, const Affine3d& world, std::span<Vec3d> corners,
                                std::span<PlacedSide> sides, std::span<PlacedEdge> edges);

}  // namespace tessera::rigid
