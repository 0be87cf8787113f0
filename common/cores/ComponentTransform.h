/// A transform about a centre.
#pragma once

#include "common/field/Field.h"
#include "common/field/NodePose.h"

namespace tessera {

/// parent_T_node = translation · centre · rotation · scaleOrientation · scale · scaleOrientation⁻¹ · centre⁻¹, as
/// OpenSG's and VRML's. Placed by whoever edits it: motions and the collision response move a Transform.
struct ComponentTransform {
    static constexpr ObjectType kType{16};
    Vec3d translation = Vec3d::Zero();
    Vec3d center = Vec3d::Zero();                ///< what rotation and scale leave where it is
    Quatd rotation = Quatd::Identity();          ///< normalised on use, never zero
    Quatd scaleOrientation = Quatd::Identity();  ///< axes of the scale; normalised on use, never zero
    Vec3d scale = Vec3d::Ones();

    [[nodiscard]] NodePose pose() const;
};
template <>
inline constexpr auto kSaid<ComponentTransform> = []<typename T>(Describing<T>) {
    return describe("ComponentTransform",
                    field<&T::translation>(1, "translation").unit(Unit::kWorld).affects(Effect::kPose),
                    field<&T::center>(2, "center").unit(Unit::kWorld).affects(Effect::kPose),
                    field<&T::rotation>(3, "rotation").affects(Effect::kPose),
                    field<&T::scaleOrientation>(4, "scaleOrientation").affects(Effect::kPose),
                    field<&T::scale>(5, "scale").affects(Effect::kPose));
};

}  // namespace tessera
