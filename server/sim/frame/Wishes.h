/// Where a frame wants Transforms to be, until collisions have had their say.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "common/math/Pose.h"
#include "server/sim/frame/ById.h"

namespace tessera {

struct Wish {
    Pose pose;
    std::vector<ObjectId> actors = {};  ///< motions and animations that want it, or a part of it
    bool whole =
        false;  ///< one of them wants all of it: an edit of a part takes the rest from where the Transform stands
    /// The edits of this frame (by index) whose ways lead there one after the other, and where each begins.
    std::vector<std::pair<std::size_t, Pose>> ways = {};

    [[nodiscard]] bool ofAnEdit() const { return !ways.empty(); }
    [[nodiscard]] std::size_t edit() const { return ways.back().first; }  ///< of an edit's: the last
};
using Wishes = ById<Wish>;  ///< of Transforms

}  // namespace tessera
