/// What turns towards the user.
#pragma once

#include "common/field/Field.h"

namespace tessera {

/// What is below turns about the node's origin until its +Z looks at the head of the user that a screen is drawn for,
/// between the eyes: the same on all tiles, screens and in both eyes of that user. Collisions and picks look at it as
/// it stands unturned.
struct Billboard {
    static constexpr ObjectType kType{23};
    /// It turns about this axis alone, in the node's coordinates; zero: about the point, its +Y as far up as that
    /// allows.
    Vec3d axis = Vec3d::UnitY();
};
template <>
inline constexpr auto kSaid<Billboard> = []<typename T>(Describing<T>) {
    return describe("Billboard", field<&T::axis>(1, "axis").between(-1e30, 1e30).affects(Effect::kPose));
};

}  // namespace tessera
