/// What a surface looks like at one place of a traversal, as Coin's state says it.
#pragma once

#include <Inventor/actions/SoCallbackAction.h>

#include "common/math/Types.h"

namespace tessera {

/// Colours as the file has them: what a screen shows, without a curve.
struct CoinLook {
    Vec3f diffuse = Vec3f::Constant(0.8f), specular = Vec3f::Zero(), emissive = Vec3f::Zero();
    float shininess = 0.2f, transparency = 0;
    float lineWidth = 1, pointSize = 1;
    bool unlit = false;
    bool backFaces = true;  ///< both sides are seen
    bool clockwise = false;
    int drawStyle = 0;  ///< SoDrawStyle::Style
};

[[nodiscard]] CoinLook lookOf(const SoCallbackAction& action);

}  // namespace tessera
