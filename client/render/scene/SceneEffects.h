/// What a core makes of its node: followers ask for roles and effects, and know no types.
#pragma once

#include <cstdint>

#include "common/scene/Aspect.h"

namespace tessera {

enum class SceneRole : std::uint8_t {
    kNothing,
    kPose,
    kChoice,
    kDrawable,
    kLight,
    kEnvironment,
    kMaterials,
    kBillboard
};
[[nodiscard]] SceneRole roleOf(const Aspect& aspect, ObjectId core);

}  // namespace tessera
