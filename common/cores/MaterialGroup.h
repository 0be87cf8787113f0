/// A material for whatever is below.
#pragma once

#include "common/cores/ShippedTypes.h"
#include "common/field/Field.h"

namespace tessera {

/// What is drawn below has this material where it brings none of its own; with `override`, whatever it brings. Of
/// several groups above, the nearest counts among those that do not override; the topmost that overrides wins over all
/// of them, as in OpenSceneGraph, except over what stands below a group that protects, there the topmost below the
/// nearest such group does.
struct MaterialGroup {
    static constexpr ObjectType kType{21};
    ObjectId material;       ///< a Material; none: the group changes nothing (it may protect)
    bool overrides = false;  ///< of what is below, its own materials too
    bool protects = false;   ///< nobody above overrides what is below
};
template <>
inline constexpr auto kSaid<MaterialGroup> = []<typename T>(Describing<T>) {
    return describe("MaterialGroup", field<&T::material>(1, "material").to(typeOf<Material>()).affects(Effect::kLook),
                    field<&T::overrides>(2, "override").affects(Effect::kLook),
                    field<&T::protects>(3, "protect").affects(Effect::kLook));
};

}  // namespace tessera
