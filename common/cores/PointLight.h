/// Light from one point.
#pragma once

#include "common/field/Field.h"
#include "common/field/LightSource.h"

namespace tessera {

/// Sits at the origin of its node.
struct PointLight {
    static constexpr ObjectType kType{9};
    Vec3f color = Vec3f::Ones();  ///< linear RGB
    float intensity = 1.0f;       ///< falls with the square of the distance in world units
    float range = 0.0f;           ///< no effect beyond. 0: unlimited

    [[nodiscard]] LightSource light() const { return {.radiance = color * intensity, .range = range}; }
};
template <>
inline constexpr auto kDescription<PointLight> =
    describe("PointLight",
             field<&PointLight::color>(1, "color").atLeast(0).affects(Effect::kLight),
             field<&PointLight::intensity>(2, "intensity").atLeast(0).affects(Effect::kLight),
             field<&PointLight::range>(3, "range").unit(Unit::kWorld).atLeast(0).affects(Effect::kLight));

}  // namespace tessera
