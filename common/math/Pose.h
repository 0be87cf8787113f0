/// Where a body is and how large.
#pragma once

#include "common/math/Types.h"

namespace tessera {

/// parent_T_body = translation · rotation · scale, as every Transform of a scene.
struct Pose {
    Vec3d translation = Vec3d::Zero();
    Quatd rotation = Quatd::Identity();
    Vec3d scale = Vec3d::Ones();
    [[nodiscard]] Affine3d matrix() const;
    /// Whether a Transform can say it: finite numbers, a rotation that can be normalised.
    [[nodiscard]] bool sound() const;
};

}  // namespace tessera
