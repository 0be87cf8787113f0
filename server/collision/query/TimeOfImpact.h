/// When do two moving bodies first touch?
#pragma once

#include <span>

#include "common/math/Types.h"
#include "server/collision/mesh/QueryWork.h"
#include "server/collision/tree/TriangleTree.h"

namespace tessera {

/// translation · rotation · scale, as every transform of a scene.
struct Pose {
    Vec3d translation = Vec3d::Zero();
    Quatd rotation = Quatd::Identity();
    Vec3d scale = Vec3d::Ones();
    [[nodiscard]] Affine3d matrix() const { return composeTransform(translation, rotation, scale); }
};

/// A body's way during one step, t from 0 to 1, in a frame that both bodies share: translation and scale linear,
/// rotation by slerp along the shorter arc. A body at rest has equal ends.
struct Motion {
    Pose start, end;
    [[nodiscard]] Pose at(double t) const;
};

struct ImpactOptions {
    double tolerance = 1e-4;  ///< above 0; in units of the shared frame
};

struct Impact {
    bool hit = false;
    /// Never after the first contact; 0 when they touch at the start. At t the distance is at most the tolerance. A
    /// motion that comes within the tolerance without touching may be reported as a hit.
    double t = 1;
    double distance = 0;   ///< exact, at t
    FacePair faces;        ///< the nearest at t
    Vec3d point, normal;   ///< in the shared frame at t; normal of unit length, from A to B
    bool complete = true;  ///< false: the work was exhausted; t is as far as the way is known to be free
};

[[nodiscard]] Impact timeOfImpact(const TriangleTree& a, const Motion& motionA, const TriangleTree& b, const Motion& motionB,
                                  QueryWork& work, const ImpactOptions& options = {});

/// Between two states of deforming bodies: every vertex goes straight from where its tree's mesh has it (t = 0) to its
/// end position (one per vertex, both in one frame).
[[nodiscard]] Impact timeOfImpact(const TriangleTree& a, std::span<const Vec3d> endA, const TriangleTree& b,
                                  std::span<const Vec3d> endB, QueryWork& work, const ImpactOptions& options = {});

}  // namespace tessera
