/// The part of the object handler that knows where everything is.
#include <algorithm>
#include <cmath>

#include "server/collision/objects/ObjectHandler.h"

namespace tessera {

void ObjectHandler::overlay(ObjectId transform, const Affine3d& local) {
    const std::uint32_t number = transformNumber(transform, ~std::uint32_t{0});
    if (number != kNobody) overlay(number, local);
}

void ObjectHandler::overlay(std::uint32_t number, const Affine3d& local) {
    const VisibleTree::Bearers& all = tree_.bearers()[number];
    if (sameBits(tree_.at(all.first).local, local)) return;
    overlaid_.push_back(all.core);
    for (std::uint32_t place = all.first; place != VisibleTree::kNone; place = tree_.nextBearer(place)) {
        tree_.at(place).local = local;
        movedPlaces_.push_back(place);
    }
    moveTouched();
    findFreeBodies();
}

void ObjectHandler::dropOverlay(const Aspect& aspect) {
    reloadOverlaid(aspect);
    moveTouched();
    findFreeBodies();
}

void ObjectHandler::reloadOverlaid(const Aspect& aspect) {
    for (const ObjectId transform : overlaid_) reload(aspect, transform);
    overlaid_.clear();
}

/// Than the scene has it.
bool ObjectHandler::standsElsewhere(const Aspect& aspect, ObjectId transform) const {
    const std::uint32_t number = transformNumber(transform, ~std::uint32_t{0});
    if (number == kNobody) return false;
    const Object core = aspect.find(transform);
    return !sameBits(tree_.at(tree_.bearers()[number].first).local, core.info().pose(core.data()).matrix);
}

/// Gives a Transform the scene's value.
void ObjectHandler::reload(const Aspect& aspect, ObjectId transform) {
    const std::uint32_t number = transformNumber(transform, ~std::uint32_t{0});
    if (number == kNobody) return;
    const Object core = aspect.find(transform);
    const Affine3d local = core.info().pose(core.data()).matrix;
    for (std::uint32_t place = tree_.bearers()[number].first; place != VisibleTree::kNone;
         place = tree_.nextBearer(place)) {
        if (sameBits(tree_.at(place).local, local)) continue;
        tree_.at(place).local = local;
        movedPlaces_.push_back(place);
    }
}

void ObjectHandler::moveTouched() {
    // From the top down, so that nothing is moved twice.
    if (movedPlaces_.size() > 1) tree_.sort(movedPlaces_);
    for (const std::uint32_t place : movedPlaces_) movePlacesBelow(place);
    movedPlaces_.clear();
}

void ObjectHandler::movePlacesBelow(std::uint32_t top) {
    static const Affine3d kTop = Affine3d::Identity();
    tree_.walk(top, [&](std::uint32_t at) {
        ++work_.places;
        Place& place = tree_.at(at);
        const Standing& standing = standings_[at];
        const Affine3d& above = place.parent == Place::kNone ? kTop : tree_.at(place.parent).world;
        // What is above it may be rigid no longer, or again.
        if (at != top && standing.body != kNobody && bodyTerms_[standing.body].candidate)
            candidates_.push_back(standing.body);
        const Affine3d world = place.below(above);
        if (sameBits(place.world, world)) return false;
        place.world = world;
        if (place.kind == CoreKind::kDrawable) noteDrawn(at);
        if (standing.part != kNobody) movePart(standing.part);
        return true;
    });
}

void ObjectHandler::movePart(std::uint32_t part) {
    const Affine3d& world = tree_.at(parts_[part].place).world;
    if (sameBits(parts_[part].world, world)) return;
    parts_[part].world = world;
    reshapePart(part);
}

}  // namespace tessera
