/// Where the wall stands in the world.
#pragma once

#include "common/field/Field.h"

namespace tessera {

/// The node's pose is the pose of the wall's coordinate system, `worldUnitsPerMetre` its scale. Frusta come from
/// screens and eyes alone. The first enabled camera in document order is the one in use.
struct Camera {
    static constexpr ObjectType kType{10};
    double worldUnitsPerMetre = 1.0;
    bool enabled = true;
};
template <>
inline constexpr auto kSaid<Camera> = []<typename T>(Describing<T>) {
    return describe("Camera",
                    field<&T::worldUnitsPerMetre>(1, "worldUnitsPerMetre")
                        .unit(Unit::kWorldPerMetre)
                        .between(1e-9, 1e9)
                        .affects(Effect::kView),
                    field<&T::enabled>(2, "enabled").affects(Effect::kView));
};

}  // namespace tessera
