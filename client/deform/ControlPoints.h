/// The control points of what stands in a scene, and the edits that lead them.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "client/deform/Deforming.h"
#include "common/change/ChangeList.h"
#include "common/scene/Aspect.h"

namespace tessera {

/// A body that has control points (SubdivisionSurface, NurbsSurface, Deformation), as they were when it was found.
struct ControlPoints {
    ObjectId core;
    ObjectType type;
    FieldId field;
    bool isDouble = false;  ///< else float
    std::vector<Vec3d> rest;
    std::string path;  ///< of the first node that bears it
};

/// Of all bodies at or below a node, each core once, in the order of the document. kNotFound: there is no such node, or
/// none of them has control points that were fetched (a lattice at rest may have none).
[[nodiscard]] Expected<std::vector<ControlPoints>> controlPointsBelow(const Aspect& scene, const std::string& node);

/// Leads them there, unless nothing of the kind is there any more or their number has changed.
void lead(ChangeListBuilder& list, const Aspect& scene, const ControlPoints& body, std::span<const Vec3d> points);

}  // namespace tessera
