#include "common/math/Pose.h"

#include "common/math/Compose.h"

namespace tessera {

Affine3d Pose::matrix() const {
    return composeTransform(translation, rotation, scale);
}

bool Pose::sound() const {
    return translation.allFinite() && scale.allFinite() && tellsRotation(rotation.squaredNorm());
}

}  // namespace tessera
