/// A choice among children.
#pragma once

#include "common/field/Field.h"

namespace tessera {

/// Shows one child, all, none, or those of a mask.
struct Switch {
    static constexpr ObjectType kType{7};
    static constexpr std::int64_t kAll = -1;
    static constexpr std::int64_t kNone = -2;
    static constexpr std::int64_t kMask = -3;
    std::int64_t choice = kAll;  ///< index of the child shown; an index past the end shows none
    std::int64_t mask = 0;  ///< of kMask: a bit for each child, the first one's lowest; from the 64th on none is shown
};
template <>
inline constexpr auto kSaid<Switch> = []<typename T>(Describing<T>) {
    return describe("Switch",
                    field<&T::choice>(1, "choice")
                        .between(Switch::kMask, 1e9)
                        .named({{Switch::kMask, "mask"}, {Switch::kNone, "none"}, {Switch::kAll, "all"}})
                        .affects(Effect::kVisibility),
                    field<&T::mask>(2, "mask").atLeast(0).affects(Effect::kVisibility));
};

}  // namespace tessera
