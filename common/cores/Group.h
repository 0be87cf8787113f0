/// A core that holds nothing.
#pragma once

#include "common/field/Field.h"

namespace tessera {

/// Nothing but children.
struct Group {
    static constexpr ObjectType kType{2};
};
template <>
inline constexpr auto kSaid<Group> = []<typename T>(Describing<T>) { return describe("Group"); };

}  // namespace tessera
