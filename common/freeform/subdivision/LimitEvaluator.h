/// Points of a subdivision surface's limit, exact but for rounding, with any positions of its control points.
///
/// Regular faces are evaluated as polynomials. Elsewhere what the face depends on is refined around the point until it
/// lies in a regular part, which happens after as many steps as its distance from an irregular vertex has halvings; at
/// the vertex itself the limit is known. Every step's points are taken relative to the nearest corner, so derivatives
/// stay exact however near that is. Topology is worked out when it is first met and kept: points of deformed control
/// meshes cost no more than the sums. Not thread-safe: one each thread, over one topology.
#pragma once

#include "common/freeform/SurfacePoint.h"
#include "common/freeform/subdivision/NeighbourhoodGraph.h"

namespace tessera {

/// In a ptex face. Of a quadrilateral u leads from vertex 0 to 1, v from 0 to 3; of a polygon's part from the corner
/// along the edge that leaves it, and along the one that arrives; of a triangle of Loop's scheme from 0 to 1 and from 0
/// to 2, where u + v is at most 1.
struct PtexPoint {
    std::uint32_t face = 0;
    double u = 0, v = 0;
};

class LimitEvaluator {
public:
    explicit LimitEvaluator(const SubdivisionTopology& topology) : topology_(topology), graph_(topology) {}

    /// kBadInput: no such face, no number, u or v outside the face by more than rounding. kRefused: the face has no
    /// surface (a hole). `positions`: one for each vertex of the topology. At a vertex where derivatives are 0 or
    /// infinite, du and dv are directions in the tangent plane (CornerLimit.h); where there is no tangent plane, the
    /// normal is zero.
    [[nodiscard]] Expected<SurfacePoint> evaluate(std::span<const Vec3d> positions, const PtexPoint& at);

    NeighbourhoodGraph& graph() { return graph_; }

private:
    SurfacePoint bilinear(std::span<const Vec3d> positions, const PtexFace& face, double u, double v) const;
    SurfacePoint smooth(const PtexFace& face, double u, double v);

    const SubdivisionTopology& topology_;
    NeighbourhoodGraph graph_;
    std::vector<Vec3d> points_, finer_;
};

}  // namespace tessera
