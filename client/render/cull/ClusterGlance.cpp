#include "client/render/cull/ClusterGlance.h"

namespace tessera {

ClusterGlance::ClusterGlance(const TileProjection& tile, const Affine3d& world_T_mesh, const Mat4d& clip_T_mesh,
                             const Vec3d& eyeWorld)
    : eye_(world_T_mesh.linear().inverse() * (eyeWorld - world_T_mesh.translation())),
      widthPx_(tile.widthPx()),
      heightPx_(tile.heightPx()),
      nearest_(tile.nearMetres()) {
    // A pixel times w is affine: x / w * half + offset, times w.
    const double offsetX = tile.xPx(0, 1), offsetY = tile.yPx(0, 1);
    const Eigen::RowVector4d x = clip_T_mesh.row(0) * (tile.xPx(1, 1) - offsetX) + clip_T_mesh.row(3) * offsetX;
    const Eigen::RowVector4d y = clip_T_mesh.row(1) * (tile.yPx(1, 1) - offsetY) + clip_T_mesh.row(3) * offsetY;
    rows_ << x.head<3>(), y.head<3>(), clip_T_mesh.row(3).head<3>();
    offset_ = {x[3], y[3], clip_T_mesh(3, 3)};
    forward_ = rows_.row(2).transpose().cwiseAbs();
}

}  // namespace tessera
