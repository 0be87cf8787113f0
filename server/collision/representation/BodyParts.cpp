#include "server/collision/representation/BodyParts.h"

namespace tessera {

BoxMap::BoxMap(const Affine3d& target_T_body, const Vec3d& reach)
    : map_(target_T_body),
      size_(target_T_body.linear().cwiseAbs()),
      // Four roundings of a point's image, and as many of a box's middle and half.
      rounding_(0x1p-53 * 32 * (size_ * reach + target_T_body.translation().cwiseAbs())),
      same_(target_T_body.matrix() == Affine3d::Identity().matrix()) {}

Box BoxMap::operator()(const Box& box) const {
    if (same_) return box;
    const Vec3d middle = map_ * Vec3d(0.5 * (box.lower + box.upper));
    const Vec3d half = size_ * (0.5 * (box.upper - box.lower)) + rounding_;
    Box out;
    out.lower = middle - half;
    out.upper = middle + half;
    return out;
}

}  // namespace tessera
