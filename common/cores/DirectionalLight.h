/// Light from one direction.
#pragma once

#include "common/cores/ShippedTypes.h"
#include "common/field/Field.h"
#include "common/field/LightSource.h"

namespace tessera {

/// Shines along -Z of its node.
struct DirectionalLight {
    static constexpr ObjectType kType{8};
    Vec3f color = Vec3f::Ones();  ///< linear RGB
    float intensity = 1.0f;
    bool shadows = false;  ///< of the first that asks; others shine through everything
    bool on = true;
    /// A Node that it stands at and looks along instead of its own, as long as that is in the scene; none: its own
    /// node.
    ObjectId beacon;
    ObjectId scope;        ///< a Node: lights what is below that alone; none: everything
    bool outside = false;  ///< with a scope: lights everything but what is below that

    [[nodiscard]] LightSource light() const {
        return {.kind = LightSource::Kind::kDirectional,
                .radiance = color * intensity,
                .shadows = shadows,
                .on = on,
                .beacon = beacon,
                .scope = scope,
                .outside = outside};
    }
};
template <>
inline constexpr auto kSaid<DirectionalLight> = []<typename T>(Describing<T>) {
    return describe("DirectionalLight", field<&T::color>(1, "color").atLeast(0).affects(Effect::kLight),
                    field<&T::intensity>(2, "intensity").atLeast(0).affects(Effect::kLight),
                    field<&T::shadows>(3, "shadows").affects(Effect::kLight),
                    field<&T::on>(4, "on").affects(Effect::kLight),
                    field<&T::beacon>(5, "beacon").to(typeOf<Node>()).affects(Effect::kLight),
                    field<&T::scope>(6, "scope").to(typeOf<Node>()).affects(Effect::kLight),
                    field<&T::outside>(7, "outside").affects(Effect::kLight));
};

}  // namespace tessera
