#include "server/collision/tree/TreeStorage.h"

namespace tessera {

kernel::Shape shapeOf(VolumeKind kind) {
    switch (kind) {
        case VolumeKind::kSphere: return kernel::Shape::kSphere;
        case VolumeKind::kObb: return kernel::Shape::kObb;
        case VolumeKind::kAabb:
        case VolumeKind::kDop6: return kernel::Shape::kDop6;
        case VolumeKind::kDop14: return kernel::Shape::kDop14;
        case VolumeKind::kDop18: return kernel::Shape::kDop18;
        case VolumeKind::kDop26: return kernel::Shape::kDop26;
    }
    return kernel::Shape::kObb;
}

unsigned rowsOf(VolumeKind kind) {
    constexpr unsigned rows[kernel::kShapes] = {4, 15, 6, 14, 18, 26};
    return rows[static_cast<std::size_t>(shapeOf(kind))];
}

std::vector<OwnPosition> ownPositions(const TreeStorage& tree) {
    const std::span<const Vec3d> from = tree.mesh.positions();
    std::vector<OwnPosition> out(from.size());
    const Vec3d centre = tree.centre;
    const double unit = tree.unit;
    for (std::size_t i = 0; i < from.size(); ++i)
        for (int axis = 0; axis < 3; ++axis) out[i].xyz0[axis] = static_cast<float>((from[i][axis] - centre[axis]) * unit);
    return out;
}

}  // namespace tessera
