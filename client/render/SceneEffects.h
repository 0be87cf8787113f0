/// What a change of a scene means to what is drawn: followers ask for effects and roles, and know no types.
#pragma once

#include <cstdint>

#include "common/scene/Aspect.h"

namespace tessera {

/// What a new value of a field affects.
enum class SceneEffect : std::uint8_t {
    kNothing,
    kStructure,   ///< what a node is
    kVisibility,  ///< which children of a node are shown
    kPose,
    kShape,  ///< the arrays of what is drawn
    kLook,   ///< its material, and what that is made of
    kLight,
};
[[nodiscard]] SceneEffect effectOf(ObjectType type, FieldId field);

/// What a core makes of its node.
enum class SceneRole : std::uint8_t { kNothing, kPose, kChoice, kDrawable, kLight, kEnvironment };
[[nodiscard]] SceneRole roleOf(const Aspect& aspect, ObjectId core);

}  // namespace tessera
