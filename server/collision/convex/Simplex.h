/// Up to four points of a Minkowski difference, and where they are nearest to the origin: the inner step of GJK.
#pragma once

#include <array>

#include "server/collision/convex/MinkowskiDifference.h"

namespace tessera {

struct Simplex {
    int size = 0;
    std::array<DifferencePoint, 4> points;

    void push(const DifferencePoint& p) { points[static_cast<std::size_t>(size++)] = p; }
    [[nodiscard]] bool has(const VertexPair& from) const {
        for (int i = 0; i < size; ++i)
            if (points[static_cast<std::size_t>(i)].from == from) return true;
        return false;
    }
};

struct SimplexNearest {
    bool inside = false;              ///< the origin lies inside four points, whatever rounding did
    double distance = 0;              ///< from the origin, rounded
    Vec3d direction = Vec3d::Zero();  ///< from the origin to the nearest point, of any length; zero where unknown
};

/// Leaves in the simplex only the points whose hull has the nearest point in its inside. By sides of edges and of faces
/// that the origin lies on, as the signed volumes of M. Montanari, N. Petrinic, E. Barbieri, "Improving the GJK
/// Algorithm for Faster and More Reliable Distance Queries Between Convex Objects", 2017; every feature on whose outer
/// side it may lie, as far as rounding can tell, is measured and the nearest one kept, so flat simplices are all right.
SimplexNearest reduce(Simplex& simplex);

}  // namespace tessera
