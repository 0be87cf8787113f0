/// A set of balls and a convex hull. For the queries of this folder.
#pragma once

#include "server/collision/convex/ConvexQuery.h"
#include "server/collision/representation/BallPairs.h"
#include "server/collision/representation/PointParts.h"

namespace tessera {

/// The balls' boxes are walked down beside the hull's; what is left goes ball by ball to the queries of hulls, with the
/// centre as a hull of one vertex.
class HullBalls {
public:
    HullBalls(const PointSet& points, const ConvexHull& hull, bool hullIsA, const Affine3d& a_T_b)
        : HullBalls(points, hull, hullIsA, a_T_b,
                    hullIsA ? radiiOf(hull, points, a_T_b) : radiiOf(points, hull, a_T_b)) {}
    HullBalls(const PointSet& points, const ConvexHull& hull, bool hullIsA, const Affine3d& a_T_b,
              const BallRadii& radii);
    HullBalls(const HullBalls&) = delete;
    HullBalls& operator=(const HullBalls&) = delete;

    [[nodiscard]] const BallRadii& radii() const { return radii_; }
    /// `any`: the first that is found; else all, ascending.
    [[nodiscard]] FacePairs touching(bool any, QueryWork& work) const;
    /// Of the centres; 0 within the hull.
    [[nodiscard]] Distance nearest(QueryWork& work, const DistanceOptions& options, double enough) const;
    [[nodiscard]] BallContact contact(const FacePair& faces, QueryWork& work) const;
    [[nodiscard]] BallDepth depth(QueryWork& work) const;

private:
    [[nodiscard]] Touch touch(std::uint32_t point, QueryWork& work, ConvexCache& cache) const;
    [[nodiscard]] HullDistance distanceTo(std::uint32_t point, QueryWork& work, ConvexCache& cache) const;
    [[nodiscard]] HullDepth depthOf(std::uint32_t point, QueryWork& work, ConvexCache& cache) const;
    [[nodiscard]] FacePair facesOf(std::uint32_t point) const {
        return hullIsA_ ? FacePair{0, point} : FacePair{point, 0};
    }
    template <typename Query>
    auto ask(std::uint32_t point, QueryWork& work, Query&& query) const;
    template <typename Visit>
    double eachNear(QueryWork& work, double& within, Visit&& visit) const;

    const PointSet& points_;
    const ConvexHull& hull_;
    bool hullIsA_;
    const Affine3d& a_T_b_;
    BallRadii radii_;
    PointParts parts_;  ///< in A's frame
    Box hullBox_;       ///< there
    double rounding_;
};

}  // namespace tessera
