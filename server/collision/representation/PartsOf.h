/// The parts of whatever body, for walks that are written once. For the queries of this folder.
#pragma once

#include "server/collision/representation/FieldParts.h"
#include "server/collision/representation/PointParts.h"
#include "server/collision/representation/TreeParts.h"

namespace tessera {

[[nodiscard]] inline TreeParts partsOf(const TriangleTree& tree, const Affine3d& target_T_tree) {
    return {tree, target_T_tree};
}
[[nodiscard]] inline FieldParts partsOf(const HeightField& field, const Affine3d& target_T_field) {
    return FieldParts(field, target_T_field);
}
[[nodiscard]] inline PointParts partsOf(const PointSet& points, const Affine3d& target_T_points) {
    return PointParts(points, target_T_points);
}

[[nodiscard]] inline bool isEmpty(const TriangleTree& tree) {
    return tree.storage().empty();
}
[[nodiscard]] inline bool isEmpty(const HeightField&) {
    return false;
}
[[nodiscard]] inline bool isEmpty(const PointSet& points) {
    return points.size() == 0;
}

}  // namespace tessera
