/// Light from one point into a cone.
#pragma once

#include <algorithm>
#include <numbers>

#include "common/cores/ShippedTypes.h"
#include "common/field/Field.h"
#include "common/field/LightSource.h"

namespace tessera {

/// Sits at the origin of its node and shines along -Z. Between the two angles it fades as glTF's KHR_lights_punctual
/// says.
struct SpotLight {
    static constexpr ObjectType kType{15};
    static constexpr float kWidest = static_cast<float>(std::numbers::pi / 2);  ///< above π/2, which no float is
    Vec3f color = Vec3f::Ones();                                                ///< linear RGB
    float intensity = 1.0f;   ///< one world unit away; see `attenuation`
    float range = 0.0f;       ///< no effect beyond. 0: unlimited
    float innerAngle = 0.0f;  ///< from the axis: full light up to here; at most the outer angle counts
    float outerAngle = static_cast<float>(std::numbers::pi / 4);  ///< from the axis: none beyond
    bool shadows = false;  ///< of the first eight that ask; others shine through everything
    bool on = true;
    /// A Node that it stands at and looks along instead of its own, as long as that is in the scene; none: its own
    /// node.
    ObjectId beacon;
    /// The falloff where a person says one, as OpenGL's: 1 / (x + y d + z d²) at distance d in world units; all 0 is no
    /// falloff.
    Vec3f attenuation{0, 0, 1};
    ObjectId scope;        ///< a Node: lights what is below that alone; none: everything
    bool outside = false;  ///< with a scope: lights everything but what is below that

    [[nodiscard]] LightSource light() const {
        return {.kind = LightSource::Kind::kSpot,
                .radiance = color * intensity,
                .range = range,
                .innerAngle = std::min(innerAngle, outerAngle),
                .outerAngle = outerAngle,
                .shadows = shadows,
                .on = on,
                .beacon = beacon,
                .attenuation = attenuation,
                .scope = scope,
                .outside = outside};
    }
};
template <>
inline constexpr auto kSaid<SpotLight> = []<typename T>(Describing<T>) {
    return describe("SpotLight", field<&T::color>(1, "color").atLeast(0).affects(Effect::kLight),
                    field<&T::intensity>(2, "intensity").atLeast(0).affects(Effect::kLight),
                    field<&T::range>(3, "range").unit(Unit::kWorld).atLeast(0).affects(Effect::kLight),
                    field<&T::innerAngle>(4, "innerAngle")
                        .unit(Unit::kRadian)
                        .between(0, SpotLight::kWidest)
                        .affects(Effect::kLight),
                    field<&T::outerAngle>(5, "outerAngle")
                        .unit(Unit::kRadian)
                        .between(0, SpotLight::kWidest)
                        .affects(Effect::kLight),
                    field<&T::shadows>(6, "shadows").affects(Effect::kLight),
                    field<&T::on>(7, "on").affects(Effect::kLight),
                    field<&T::beacon>(8, "beacon").to(typeOf<Node>()).affects(Effect::kLight),
                    field<&T::attenuation>(9, "attenuation").between(0, 1e12).affects(Effect::kLight),
                    field<&T::scope>(10, "scope").to(typeOf<Node>()).affects(Effect::kLight),
                    field<&T::outside>(11, "outside").affects(Effect::kLight));
};

}  // namespace tessera
