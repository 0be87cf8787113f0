/// Back to the world's coordinates.
#pragma once

#include "common/field/Field.h"
#include "common/field/NodePose.h"

namespace tessera {

/// Undoes every transform above its node: what is below stands in world coordinates, wherever the node hangs.
struct InverseTransform {
    static constexpr ObjectType kType{17};

    [[nodiscard]] NodePose pose() const;
};
template <>
inline constexpr auto kSaid<InverseTransform> = []<typename T>(Describing<T>) { return describe("InverseTransform"); };

}  // namespace tessera
