/// The part of the object handler that finds out what belongs to whom: what is below a place inherits what it has not
/// of its own, so that only what is below a change is looked at.
#include <algorithm>
#include <utility>

#include "common/cores/Interest.h"
#include "server/collision/objects/ObjectHandler.h"

namespace tessera {

void ObjectHandler::removeGone() {
    for (const std::uint32_t place : tree_.changes().gone) {
        ++work_.places;
        const Standing& standing = standings_[place];
        noteDrawn(place);
        leaveGroup(place);
        if (standing.part != kNobody) removePart(standing.part);
        if (standing.body != kNobody) touchBody(standing.body);
        if (interestNodes_.find(tree_.at(place).node) != IdTable::kNone) interestsDirty_ = true;
    }
}

/// Names and poses of what has been placed, bears another core, or is carried elsewhere.
void ObjectHandler::welcomePlaced() {
    VisibleTree::Changes& changes = tree_.changes();
    tree_.topmost(changes.placed);
    for (const std::uint32_t at : changes.recored) {
        const Standing& standing = standings_[at];
        inheriting_.push_back(at);
        unsettled_.push_back(at);
        noteDrawn(at);
        if (standing.part != kNobody) touchedParts_.push_back(standing.part);
        if (standing.body != kNobody) touchBody(standing.body);
        movedPlaces_.push_back(at);
    }
    // All from the top down at once: what is below several of them never stands where only one would have it, so that
    // what stands in the end where it stood has not moved.
    std::vector<std::uint32_t> tops = std::exchange(movedPlaces_, {});
    tops.insert(tops.end(), changes.placed.begin(), changes.placed.end());
    tree_.sort(tops);
    auto placed = changes.placed.begin();
    for (const std::uint32_t top : tops)
        if (placed != changes.placed.end() && *placed == top) {
            welcomeBelow(top);
            ++placed;
        } else {
            movePlacesBelow(top);
        }
}

void ObjectHandler::welcomeBelow(std::uint32_t top) {
    static const Affine3d kTop = Affine3d::Identity();
    VisibleTree::Changes& changes = tree_.changes();
    tree_.walk(top, [&](std::uint32_t at) {
        ++work_.places;
        Place& place = tree_.at(at);
        Standing& standing = standings_[at];
        const Affine3d& above = place.parent == Place::kNone ? kTop : tree_.at(place.parent).world;
        const Affine3d world = place.below(above);
        const bool moved = !sameBits(place.world, world);
        place.world = world;
        standing.newHere = update_;
        standing.named = objects_.naming(place.node);
        if (interestNodes_.find(place.node) != IdTable::kNone) interestsDirty_ = true;
        if (place.kind == CoreKind::kInterest) interestsDirty_ = true;
        if (place.kind == CoreKind::kEnvironment) changes.environments = true;
        if (place.kind == CoreKind::kDrawable) {
            noteDrawn(at);
            unsettled_.push_back(at);
        }
        if (standing.part != kNobody) {
            // Its body's parts may stand in another order, and so may those of its pairs.
            touchBody(parts_[standing.part].body);
            noteReworded(standing.part);
            if (moved) movePart(standing.part);
        }
        if (standing.body != kNobody) touchBody(standing.body);
        return true;
    });
}

/// Where inheritance may begin to differ, from above down. What has just been placed is looked at from its top.
std::vector<std::uint32_t> ObjectHandler::heirs() {
    std::vector<std::uint32_t> roots = tree_.changes().placed;
    for (const std::uint32_t place : inheriting_)
        if (standings_[place].newHere != update_) roots.push_back(place);
    tree_.sort(roots);
    return roots;
}

/// To which CollisionObject places belong, and to which item of a divided one.
void ObjectHandler::inheritObjects() {
    for (const std::uint32_t root : heirs())
        tree_.walk(root, [&](std::uint32_t at) {
            ++work_.places;
            const Place& place = tree_.at(at);
            Standing& standing = standings_[at];
            static const Standing kAboveAll;
            const Standing& above = place.parent == Place::kNone ? kAboveAll : standings_[place.parent];
            const bool own = standing.named != kNobody;
            const std::uint32_t object = own ? standing.named : above.object;
            std::uint32_t top = kNobody;
            bool isTop = false, otherRules = false;
            if (object != kNobody) {
                const CollisionObjectTable::Entry& entry = objects_.at(object);
                const bool child = !own && entry.division == CollisionWords::kEachChild && above.named != kNobody;
                const bool each = entry.division == CollisionWords::kEachGeometry;
                top = own || child || each ? at : above.top;
                isTop = entry.layers != 0 && (own || child || (each && place.kind == CoreKind::kDrawable));
                otherRules = entry.changed == update_;
            }
            // (What is below one that is named no longer is an item no longer.)
            const bool differs =
                object != standing.object || top != standing.top || standing.named != standing.wasNamed || otherRules;
            standing.wasNamed = standing.named;
            standing.object = object;
            standing.top = top;
            if (isTop != standing.isTop) {
                standing.isTop = isTop;
                tree_.count(at, 0, isTop ? 1 : -1);
            }
            if (differs) {
                standing.changed = update_;
                if (place.kind == CoreKind::kDrawable) unsettled_.push_back(at);
            }
            return differs || standing.newHere == update_;
        });
}

/// Lists the enabled interests that are visible, up to the limit, and marks the places where their sides begin.
std::vector<InterestSides> ObjectHandler::findInterests(const Aspect& aspect) {
    std::vector<std::pair<std::uint32_t, ObjectId>> inOrder;
    for (const ObjectId id : tree_.interests()) inOrder.emplace_back(tree_.firstBearer(tree_.bearersOf(id)), id);
    const auto before = [&](const auto& a, const auto& b) { return tree_.order().before(a.first, b.first); };
    if (!std::is_sorted(inOrder.begin(), inOrder.end(), before)) std::sort(inOrder.begin(), inOrder.end(), before);
    interests_.clear();
    interestNumbers_.reset(inOrder.size());
    interestNodes_.reset(2 * inOrder.size());
    interestsLeftOut_ = 0;
    std::vector<InterestSides> sides;
    struct Mark {
        std::uint32_t place;
        bool makes;
    };
    std::vector<Mark> marksBefore, marks;
    for (const auto& [first, id] : inOrder) {
        const Interest& core = *aspect.get<Interest>(id);
        if (core.enabled == 0) {
            interestNumbers_.insert(id, kDisabled);
            continue;
        }
        if (interests_.size() == interestCap_) {
            interestNumbers_.insert(id, kLeftOut);
            ++interestsLeftOut_;
            continue;
        }
        interestNumbers_.insert(id, static_cast<std::uint32_t>(interests_.size()));
        interests_.push_back({id, core.response, core.mode, core.detail, core.threshold, core.show, core.patience});
        const bool alone = core.mode == InterestWords::kSelf;
        const ObjectId othersNode = alone ? core.object : core.against ? core.against : kRootNode;
        if (core.object) interestNodes_.insert(core.object, 0);
        interestNodes_.insert(othersNode, 0);
        InterestSides& side = sides.emplace_back();
        side.ignores = core.mode == InterestWords::kIgnore;
        side.alone = alone;
        side.objectLayers = core.objectLayers;
        side.againstLayers = core.againstLayers;
        // A node that is hidden, detached or gone: the interest sleeps.
        const std::uint32_t object = tree_.find(core.object), against = tree_.find(othersNode);
        side.awake = object != VisibleTree::kNone && against != VisibleTree::kNone;
        if (!side.awake) continue;
        side.object = object;
        side.against = against;
        side.oneObject = tree_.at(object).objects == 0;
        // To ignore is no wish to see as one.
        marks.push_back({object, side.oneObject && !side.ignores});
        marks.push_back({against, false});
    }
    for (const std::uint32_t place : marked_) {
        marksBefore.push_back({place, standings_[place].makes});
        standings_[place].makes = standings_[place].begins = false;
        tree_.watch(place, false);
    }
    marked_.clear();
    for (const Mark& mark : marks) {
        Standing& standing = standings_[mark.place];
        if (!standing.begins) marked_.push_back(mark.place);
        standing.begins = true;
        standing.makes = standing.makes || mark.makes;
        tree_.watch(mark.place, true);
    }
    std::sort(marked_.begin(), marked_.end());
    for (const Mark& mark : marksBefore) {
        const bool stands = tree_.find(tree_.at(mark.place).node) == mark.place;
        if (stands && (!standings_[mark.place].begins || standings_[mark.place].makes != mark.makes))
            inheriting_.push_back(mark.place);
    }
    std::sort(marksBefore.begin(), marksBefore.end(), [](const Mark& a, const Mark& b) { return a.place < b.place; });
    for (const std::uint32_t place : marked_)
        if (!std::ranges::binary_search(marksBefore, place, {}, &Mark::place)) inheriting_.push_back(place);
    return sides;
}

/// What interests make an object of, and the nearest place where a side begins.
void ObjectHandler::inheritSides() {
    for (const std::uint32_t root : heirs())
        tree_.walk(root, [&](std::uint32_t at) {
            ++work_.places;
            const Place& place = tree_.at(at);
            Standing& standing = standings_[at];
            const bool atTop = place.parent == Place::kNone;
            const std::uint32_t made = standing.makes ? at : atTop ? kNobody : standings_[place.parent].made;
            const std::uint32_t side = standing.begins ? at : atTop ? kNobody : standings_[place.parent].side;
            if (made != standing.made || side != standing.side) standing.changed = update_;
            standing.made = made;
            standing.side = side;
            // A body is on a side where its topmost place is.
            const std::uint32_t top = standing.object != kNobody ? standing.top : made;
            const bool look = standing.changed == update_ || standing.newHere == update_ ||
                              (top != kNobody && standings_[top].changed == update_);
            if (look && place.kind == CoreKind::kDrawable) unsettled_.push_back(at);
            return look;
        });
}

std::uint32_t ObjectHandler::sideAbove(std::uint32_t place) const {
    const std::uint32_t parent = tree_.at(place).parent;
    return parent == Place::kNone ? kNobody : standings_[parent].side;
}

/// Gives a drawable its group and, where it takes part, its body.
void ObjectHandler::settle(std::uint32_t at) {
    const Place& place = tree_.at(at);
    Standing& standing = standings_[at];
    Likeness like;
    std::uint32_t top = at;
    like.side = standing.side;
    like.object = standing.object != kNobody;
    if (like.object) {
        like.layers = objects_.at(standing.object).layers;
        top = standing.top;
        like.bodySide = standings_[top].side;
    } else if (standing.made != kNobody) {
        top = standing.made;
    }
    ++work_.parts;
    const bool counts = place.kind == CoreKind::kDrawable && like.side != kNobody && like.layers != 0;
    if (counts && (standing.group == kNobody || relations_.likeness(standing.group) != like)) {
        leaveGroup(at);
        standing.group = relations_.join(like, at, [this](std::uint32_t from) { return sideAbove(from); });
        standing.member = static_cast<std::uint32_t>(relations_.members(standing.group).size() - 1);
    } else if (!counts) {
        leaveGroup(at);
    }
    if (standing.group == kNobody || !relations_.takesPart(standing.group)) {
        if (standing.part != kNobody) removePart(standing.part);
        return;
    }
    if (standing.part == kNobody) addPart(at);
    assign(standing.part, standing.group, top);
}

void ObjectHandler::leaveGroup(std::uint32_t place) {
    Standing& standing = standings_[place];
    if (standing.group == kNobody) return;
    if (standing.part != kNobody) {  // first, since the group's number may be given to another one
        leaveBody(standing.part);
        relations_.setPart(standing.part, kNobody, kNobody);
        noteRegrouped(standing.part);
    }
    standings_[relations_.members(standing.group).back()].member = standing.member;
    relations_.leave(standing.group, standing.member);
    standing.group = kNobody;
}

}  // namespace tessera
