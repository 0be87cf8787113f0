/// A core that holds nothing.
#pragma once

#include "common/field/Field.h"

namespace tessera {

/// Nothing but children.
struct Group {
    static constexpr ObjectType kType{2};
};
template <>
inline constexpr auto kDescription<Group> = describe("Group");

}  // namespace tessera
