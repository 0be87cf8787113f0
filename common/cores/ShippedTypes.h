/// The types of objects that a scene can hold, by name and number: for those who speak of a type and hold none of it.
/// Each struct stands in a header of its own, so that a field more in one costs those alone who use that one.
#pragma once

#include "common/field/Field.h"

namespace tessera {

/// In the order of their numbers, from 1 on: a new one comes last, and none is taken out.
using ShippedTypes =
    TypeList<struct Node, struct Group, struct Transform, struct Geometry, struct Material, struct Image, struct Switch,
             struct DirectionalLight, struct PointLight, struct Camera, struct Motion, struct Environment,
             struct Interest, struct CollisionObject, struct SpotLight, struct ComponentTransform,
             struct InverseTransform, struct SubdivisionSurface, struct NurbsSurfaceCore, struct Deformation,
             struct MaterialGroup, struct DistanceLOD, struct Billboard, struct KeyFrames, struct Animation,
             struct Skin, struct Text, struct Inline, struct ProxyGroup, struct Particles, struct Volume,
             struct TextureLayer, struct SurfaceProgram, struct Uniform, struct Movie, struct Manipulator,
             struct ApplicationData, struct ParticleEmitter, struct Glyphs>;

/// The number of a type: of a shipped one its place in that list, whether its struct is known here or not.
template <typename T>
[[nodiscard]] constexpr ObjectType typeOf() {
    if constexpr (isIn<T>(ShippedTypes()))
        return ObjectType{static_cast<std::uint16_t>(placeIn<T>(ShippedTypes()) + 1)};
    else
        return T::kType;
}

}  // namespace tessera
