/// What the queries of PointSetQueries.h share: radii in A's frame, and what two bodies of which one is balls are to
/// each other at a pair of faces. For the queries of this folder.
#pragma once

#include "server/collision/mesh/TriangleContact.h"
#include "server/collision/representation/PointSetQueries.h"

namespace tessera {

/// The largest singular value; of a similarity its scale, to 1e-13.
[[nodiscard]] double largestStretch(const Mat3d& linear);

/// The radii of both sides in A's frame; 0 of what are no balls.
struct BallRadii {
    double a = 0, b = 0;

    [[nodiscard]] double sum() const { return a + b; }
    /// Balls whose centres, or whose centre and face, are so far apart touch.
    [[nodiscard]] double reach() const { return sum() * (1 + 1e-12); }
};

[[nodiscard]] inline double radiusOf(const PointSet& points) {
    return points.radius();
}
template <typename Other>
[[nodiscard]] double radiusOf(const Other&) {
    return 0;
}
template <typename A, typename B>
[[nodiscard]] BallRadii radiiOf(const A& a, const B& b, const Affine3d& a_T_b) {
    const double ofB = radiusOf(b);
    return {radiusOf(a), ofB > 0 ? ofB * largestStretch(a_T_b.linear()) : 0};
}

/// Of the nearest points of the centres and the other's faces; `along` where these are in one place to within
/// `rounding`.
[[nodiscard]] BallContact contactOfBalls(const FacePair& faces, const NearestPoints& near, const BallRadii& radii,
                                         const Vec3d& along, double rounding);

/// A distance of centres as one of balls: `near` is what a search for the nearest pair of these found up to the bound
/// plus the radii.
[[nodiscard]] Distance distanceOfBalls(const Distance& near, const BallRadii& radii, const DistanceOptions& options);

}  // namespace tessera

/// DO(A, B) for every pair of bodies of WithBalls: where a query is instantiated.
#define TESSERA_BALL_PAIRS(DO) \
    DO(PointSet, TriangleTree) \
    DO(TriangleTree, PointSet) \
    DO(PointSet, HeightField)  \
    DO(HeightField, PointSet)  \
    DO(PointSet, ConvexHull)   \
    DO(ConvexHull, PointSet)   \
    DO(PointSet, PointSet)
