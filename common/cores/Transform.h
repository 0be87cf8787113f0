/// Where what is below a node stands.
#pragma once

#include "common/field/Field.h"
#include "common/field/NodePose.h"

namespace tessera {

/// parent_T_node = translation · rotation · scale. What motions, people and the collision response move.
struct Transform {
    static constexpr ObjectType kType{3};
    Vec3d translation = Vec3d::Zero();
    Quatd rotation = Quatd::Identity();  ///< normalised on use, never zero
    Vec3d scale = Vec3d::Ones();

    [[nodiscard]] NodePose pose() const;
};
template <>
inline constexpr auto kSaid<Transform> = []<typename T>(Describing<T>) {
    return describe("Transform", field<&T::translation>(1, "translation").unit(Unit::kWorld).affects(Effect::kPose),
                    field<&T::rotation>(2, "rotation").affects(Effect::kPose),
                    field<&T::scale>(3, "scale").affects(Effect::kPose));
};

}  // namespace tessera
