/// Where a frame wants Transforms to be, until collisions have had their say.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/math/Pose.h"
#include "server/sim/frame/ById.h"

namespace tessera {

struct Wish {
    Pose pose;
    std::vector<ObjectId> actors = {};  ///< motions and animations that want it, or a part of it
    std::uint32_t way = 0;              ///< of the last edit of this frame that leads there: see `Wishes`; 0: of none
    /// One of the actors wants all of it: an edit of a part takes the rest from where the Transform stands.
    bool whole = false;
};

/// The wishes of one frame for Transforms, and the ways of its edits: of a Transform they lead there one after the
/// other. Both keep their room for the next frame.
class Wishes : public ById<Wish> {
public:
    struct Way {
        std::size_t edit = 0;      ///< by its index in the frame
        Pose from;                 ///< where it begins
        std::uint32_t before = 0;  ///< the way that leads there; 0: none
    };

    /// The last edit's; null: no edit wants it.
    [[nodiscard]] const Way* lastWay(const Wish& wish) const { return at(wish.way); }
    [[nodiscard]] const Way* wayBefore(const Way& way) const { return at(way.before); }
    void addWay(Wish& wish, std::size_t edit, const Pose& from) {
        ways_.push_back({.edit = edit, .from = from, .before = wish.way});
        wish.way = static_cast<std::uint32_t>(ways_.size());
    }
    void clear() {
        clearButKeepRoom(ways_);
        ById::clear();
    }

private:
    [[nodiscard]] const Way* at(std::uint32_t way) const { return way == 0 ? nullptr : &ways_[way - 1]; }
    std::vector<Way> ways_;
};

}  // namespace tessera
