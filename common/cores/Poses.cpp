// Where cores put what is below their nodes. Here and not in their headers, because the products would be compiled
// wherever a header is; and all together, because a traversal does little else than `placeBelow`: in one piece, without
// a call or a matrix in between.
#include "common/cores/ComponentTransform.h"
#include "common/cores/InverseTransform.h"
#include "common/cores/Transform.h"
#include "common/math/Compose.h"

namespace tessera {

NodePose Transform::pose() const {
    return {.matrix = composeTransform(translation, rotation, scale)};
}

NodePose ComponentTransform::pose() const {
    const Mat3d axes = scaleOrientation.normalized().toRotationMatrix();
    Affine3d matrix;
    matrix.linear() = rotation.normalized().toRotationMatrix() * axes * scale.asDiagonal() * axes.transpose();
    matrix.translation() = translation + center - matrix.linear() * center;
    matrix.makeAffine();
    return {.matrix = matrix};
}

NodePose InverseTransform::pose() const {
    return {.absolute = true};
}

namespace {
const NodePose& poseOf(const NodePose& pose) {
    return pose;
}
template <typename Core>
NodePose poseOf(const Core& core) {
    return core.pose();
}
}  // namespace

template <typename Core>
[[gnu::flatten]] void placeBelow(const Core& core, const Affine3d& world_T_parent, Affine3d& world_T_node) {
    const NodePose& pose = poseOf(core);
    if (pose.absolute) {
        world_T_node = pose.matrix;
        return;
    }
    world_T_node.linear().noalias() = world_T_parent.linear() * pose.matrix.linear();
    world_T_node.translation().noalias() =
        world_T_parent.linear() * pose.matrix.translation() + world_T_parent.translation();
    world_T_node.makeAffine();
}

template void placeBelow(const NodePose&, const Affine3d&, Affine3d&);
template void placeBelow(const Transform&, const Affine3d&, Affine3d&);
template void placeBelow(const ComponentTransform&, const Affine3d&, Affine3d&);
template void placeBelow(const InverseTransform&, const Affine3d&, Affine3d&);

}  // namespace tessera
