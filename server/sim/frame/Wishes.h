/// Where a frame wants Transforms to be, until collisions have had their say.
#pragma once

#include <cstddef>
#include <map>
#include <utility>
#include <vector>

#include "common/change/Value.h"
#include "common/math/Pose.h"

namespace tessera {

struct Wish {
    Pose pose;
    std::vector<ObjectId> actors = {};  ///< motions and animations that want it, or a part of it
    bool whole =
        false;  ///< one of them wants all of it: an edit of a part takes the rest from where the Transform stands
    std::size_t edit = 0;  ///< index of the edit that wants it
    /// The edits of this frame whose ways lead there one after the other, `edit` the last, and where each begins.
    std::vector<std::pair<std::size_t, Pose>> ways = {};

    [[nodiscard]] bool ofAnEdit() const { return actors.empty(); }
};
using Wishes = std::map<ObjectId, Wish>;  ///< by Transform

}  // namespace tessera
