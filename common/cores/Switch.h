/// A choice among children.
#pragma once

#include "common/field/Field.h"

namespace tessera {

/// Shows one child, all or none.
struct Switch {
    static constexpr ObjectType kType{7};
    static constexpr std::int64_t kAll = -1;
    static constexpr std::int64_t kNone = -2;
    std::int64_t choice = kAll;  ///< index of the child shown; an index past the end shows none
};
template <>
inline constexpr auto kDescription<Switch> =
    describe("Switch", field<&Switch::choice>(1, "choice")
                           .between(Switch::kNone, 1e9)
                           .named({{Switch::kNone, "none"}, {Switch::kAll, "all"}})
                           .affects(Effect::kVisibility));

}  // namespace tessera
