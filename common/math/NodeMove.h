/// What somebody wants of the place of a node.
#pragma once

#include <optional>

#include "common/math/Types.h"

namespace tessera {

/// What becomes of a node's Transform; unset parts stay as they are.
struct NodeMove {
    std::optional<Vec3d> translation;  ///< in the parent's coordinates
    std::optional<Quatd> rotation;     ///< any length but zero
    std::optional<Vec3d> scale;
    /// Add to what is there: the translation is added, the rotation follows the present one (in the parent's
    /// coordinates), the scale multiplies it.
    bool relative = false;
};

}  // namespace tessera
