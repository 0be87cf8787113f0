/// Which visible geometry belongs to which body: the rules of CollisionObject and Interest::object.
#pragma once

#include <cstdint>
#include <vector>

#include "common/scene/Aspect.h"
#include "server/collision/objects/VisibleTree.h"

namespace tessera {

/// Answers by place. First what the visible CollisionObjects say; then interests add objects of their own where there
/// is no CollisionObject (`makeObject`), and `finish` settles whose geometry is whose.
class BodyRules {
public:
    static constexpr std::uint32_t kNone = Place::kNone;

    BodyRules(const Aspect& aspect, const VisibleTree& tree);

    /// Is there an object (an item of a divided one counts; one without layers does not) at or below this place?
    [[nodiscard]] bool anyObjectAt(std::uint32_t place) const;
    /// This place and what is below it, but for CollisionObjects, is one object. Of nested ones the deeper wins.
    void makeObject(std::uint32_t place) { made_[place] = place; }
    void finish();

    /// Of geometry at this place: the topmost place of its body.
    [[nodiscard]] std::uint32_t bodyOf(std::uint32_t place) const {
        if (top_[place] != kNone) return top_[place];
        return made_[place] != kNone ? made_[place] : place;
    }
    /// The CollisionObject that this place belongs to: an index into VisibleTree::objects, or kNone.
    [[nodiscard]] std::uint32_t objectOf(std::uint32_t place) const { return object_[place]; }

private:
    const VisibleTree& tree_;
    std::vector<std::uint32_t> object_;       // per place: the nearest named place's object
    std::vector<std::uint32_t> top_;          // per place that belongs to an object: the topmost place of its item
    std::vector<std::uint32_t> made_;         // per place: the nearest place that an interest made an object
    std::vector<std::uint32_t> objectsUpTo_;  // how many objects, or geometries that are items, stand before a place
};

}  // namespace tessera
