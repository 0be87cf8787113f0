/// The surroundings.
#pragma once

#include "common/field/Field.h"

namespace tessera {

/// Light from everywhere, what is seen where nothing is, and gravity. The first one in document order is used.
struct Environment {
    static constexpr ObjectType kType{12};
    Vec3f sky{0.30f, 0.33f, 0.38f};         ///< ambient radiance from +Y, linear RGB
    Vec3f ground{0.12f, 0.11f, 0.10f};      ///< ambient radiance from -Y
    Vec3f background{0.05f, 0.06f, 0.08f};  ///< linear colour of empty pixels
    Vec3d gravity = Vec3d::Zero();          ///< acceleration of free bodies
};
template <>
inline constexpr auto kDescription<Environment> =
    describe("Environment",
             field<&Environment::sky>(1, "sky").affects(Effect::kLight),
             field<&Environment::ground>(2, "ground").affects(Effect::kLight),
             field<&Environment::background>(3, "background").affects(Effect::kLight),
             field<&Environment::gravity>(4, "gravity").unit(Unit::kWorldPerSecond2).between(-1e6, 1e6).affects(Effect::kTerms));

}  // namespace tessera
