/// A half line, for picking.
#pragma once

#include "common/math/Types.h"

namespace tessera {

/// Points origin + t * direction with t >= 0. The direction need not be normalised; t counts in its length.
struct Ray {
    Vec3d origin = Vec3d::Zero();
    Vec3d direction = -Vec3d::UnitZ();
    bool operator==(const Ray&) const = default;
};

}  // namespace tessera
