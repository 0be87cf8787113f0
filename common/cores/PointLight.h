/// Light from one point.
#pragma once

#include "common/cores/ShippedTypes.h"
#include "common/field/Field.h"
#include "common/field/LightSource.h"

namespace tessera {

/// Sits at the origin of its node.
struct PointLight {
    static constexpr ObjectType kType{9};
    Vec3f color = Vec3f::Ones();  ///< linear RGB
    float intensity = 1.0f;       ///< one world unit away; see `attenuation`
    float range = 0.0f;           ///< no effect beyond. 0: unlimited
    bool on = true;
    /// A Node that it stands at and looks along instead of its own, as long as that is in the scene; none: its own
    /// node.
    ObjectId beacon;
    /// The falloff where a person says one, as OpenGL's: 1 / (x + y d + z d²) at distance d in world units; all 0 is no
    /// falloff.
    Vec3f attenuation{0, 0, 1};
    ObjectId scope;        ///< a Node: lights what is below that alone; none: everything
    bool outside = false;  ///< with a scope: lights everything but what is below that
    bool shadows = false;  ///< of the first four that ask; others shine through everything

    [[nodiscard]] LightSource light() const {
        return {.radiance = color * intensity,
                .range = range,
                .shadows = shadows,
                .on = on,
                .beacon = beacon,
                .attenuation = attenuation,
                .scope = scope,
                .outside = outside};
    }
};
template <>
inline constexpr auto kSaid<PointLight> = []<typename T>(Describing<T>) {
    return describe("PointLight", field<&T::color>(1, "color").atLeast(0).affects(Effect::kLight),
                    field<&T::intensity>(2, "intensity").atLeast(0).affects(Effect::kLight),
                    field<&T::range>(3, "range").unit(Unit::kWorld).atLeast(0).affects(Effect::kLight),
                    field<&T::on>(4, "on").affects(Effect::kLight),
                    field<&T::beacon>(5, "beacon").to(typeOf<Node>()).affects(Effect::kLight),
                    field<&T::attenuation>(6, "attenuation").between(0, 1e12).affects(Effect::kLight),
                    field<&T::scope>(7, "scope").to(typeOf<Node>()).affects(Effect::kLight),
                    field<&T::outside>(8, "outside").affects(Effect::kLight),
                    field<&T::shadows>(9, "shadows").affects(Effect::kLight));
};

}  // namespace tessera
