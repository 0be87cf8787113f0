#include "server/collision/objects/ObjectHandler.h"

#include <algorithm>
#include <utility>

#include "common/cores/CollisionObject.h"
#include "common/cores/Environment.h"
#include "common/cores/Interest.h"
#include "server/collision/objects/SortOnce.h"

namespace tessera {

namespace {

std::vector<ObjectId> together(const SceneEffects::Rows& rows) {
    std::vector<ObjectId> all;
    for (const std::span<const ObjectId> some : rows) all.insert(all.end(), some.begin(), some.end());
    return all;
}

}  // namespace

void ObjectHandler::update(const Aspect& aspect, const ChangeList* list) {
    if (!list || generation_ == 0) {  // the first list may be the one that made the scene
        begin(aspect, true);
        return;
    }
    const SceneEffects effects = sceneEffectsOf(*list);
    // Which interests are beyond the limits is found anew.
    if (effects.structural() && interestsLeftOut_ > 0) {
        begin(aspect, false);
        return;
    }
    ++update_;
    if (effects.structural()) {
        tree_.follow(aspect, effects.placements, together(effects.cores), together(effects.choices));
        standings_.growTo(tree_.places().size());
        for (const std::span<const ObjectId> rows : effects.objectRules)
            for (const ObjectId core : rows)
                if (objects_.find(core) != IdTable::kNone) tree_.changes().objects.push_back(core);
        for (const std::span<const ObjectId> rows : effects.interestRules)
            for (const ObjectId core : rows)
                interestsDirty_ = interestsDirty_ || tree_.bearersOf(core) != VisibleTree::kNone;
        removeGone();
    }
    // What was laid over the scene is now committed, or was refused.
    for (const std::span<const ObjectId> rows : effects.poses)
        for (const ObjectId transform : rows) reload(aspect, transform);
    reloadOverlaid(aspect);
    if (!effects.structural()) moveTouched();  // else together with what is placed
    if (effects.structural()) {
        settleStructure(aspect);
        if (beyondLimits()) {
            begin(aspect, false);
            return;
        }
    }
    applyTerms(aspect, effects);
    shapeParts(aspect, false);
    findFreeBodies();
    endUpdate();
}

bool ObjectHandler::wouldChange(const Aspect& aspect, const ChangeList& list) const {
    if (generation_ == 0) return true;
    const SceneEffects effects = sceneEffectsOf(list);
    if (effects.structural() || !effects.shapes.empty() || !effects.interestTerms.empty()) return true;
    const auto moved = [&](ObjectId transform) { return standsElsewhere(aspect, transform); };
    return std::ranges::any_of(overlaid_, moved) ||
           std::ranges::any_of(effects.poses, [&](const auto& rows) { return std::ranges::any_of(rows, moved); });
}

/// Everything anew, by the same steps: all that is visible has just been placed.
void ObjectHandler::begin(const Aspect& aspect, bool jump) {
    remembered_.clear();
    for (const Part& part : parts_)  // but those that the list has just brought
        if (part.node && part.poseVersion != 0)
            remembered_.insert({part.node, {part.shape, part.world, part.worldBox, part.poseVersion}});
    // Interests that would make too many groups do not count, nor do those after them.
    const auto fits = [&](std::size_t most) {
        interestCap_ = most;
        seeAll(aspect);
        return relations_.size() <= limits_.maxGroups;
    };
    if (!fits(limits_.maxInterests)) {
        std::size_t low = 0, high = interests_.size();
        while (high - low > 1) {
            const std::size_t middle = low + (high - low) / 2;
            (fits(middle) ? low : high) = middle;
        }
        (void)fits(low);
        interestCap_ = limits_.maxInterests;
    }
    ++work_.anew;
    shapeParts(aspect, jump);
    remembered_.clear();
    findGravity(aspect);
    findFreeBodies();
    endUpdate();
    (void)takeRegrouped();
    (void)takeReworded();
    (void)takeFreeChanged();
    drawnAll_ = true;
    shapes_->forgetIdle();
}

void ObjectHandler::seeAll(const Aspect& aspect) {
    ++generation_;
    ++update_;
    standings_.clear();
    objects_.clear();
    overlaid_.clear();
    movedPlaces_.clear();
    inheriting_.clear();
    unsettled_.clear();
    touchedBodies_.clear();
    touchedParts_.clear();
    candidates_.clear();
    parts_.clear();
    partTerms_.clear();
    freeParts_.clear();
    partsGone_.clear();
    movedParts_.clear();
    regroupedParts_.clear();
    rewordedParts_.clear();
    drawn_.clear();
    skipped_ = 0;
    standIns_.clear();
    bodies_.clear();
    bodyTerms_.clear();
    freeBodyNumbers_.clear();
    freeBodies_.clear();
    freeChanged_.clear();
    interests_.clear();
    interestNumbers_.reset(0);
    interestNodes_.reset(0);
    marked_.clear();
    relations_.clear();
    deformingParts_.clear();
    deformingDirty_ = true;
    interestsDirty_ = true;
    tree_.begin(aspect);
    standings_.growTo(tree_.places().size());
    settleStructure(aspect);
}

/// From what the tree has found to who belongs to whom.
void ObjectHandler::settleStructure(const Aspect& aspect) {
    ++structure_;
    welcomePlaced();
    VisibleTree::Changes& changes = tree_.changes();
    sortOnce(changes.objects);
    std::vector<ObjectId> named;
    for (const ObjectId core : changes.objects)
        objects_.follow(aspect, core, tree_.bearersOf(core) != VisibleTree::kNone, update_, named);
    for (const ObjectId node : named) {
        const std::uint32_t place = tree_.find(node);
        if (place == VisibleTree::kNone) continue;
        standings_[place].named = objects_.naming(node);
        inheriting_.push_back(place);
    }
    for (const ObjectId core : changes.shared)
        if (const std::uint32_t number = tree_.bearersOf(core); number != VisibleTree::kNone)
            tree_.forBearers(number, [&](std::uint32_t place) {
                if (standings_[place].body != kNobody) touchBody(standings_[place].body);
            });
    inheritObjects();
    interestsDirty_ = interestsDirty_ || changes.interests || tree_.watchedChanged();
    tree_.forgetWatched();
    if (interestsDirty_) {
        const std::vector<InterestTerms> before = std::move(interests_);
        const std::vector<InterestSides> sides = findInterests(aspect);
        inheritSides();
        relations_.setInterests(interests_, sides, [this](std::uint32_t place) { return sideAbove(place); });
        ++interestsVersion_;
        noteReworded(before);
        for (const std::uint32_t group : relations_.takeChanged())
            for (const std::uint32_t place : relations_.members(group)) {
                unsettled_.push_back(place);
                if (standings_[place].part != kNobody) noteRegrouped(standings_[place].part);
            }
        interestsDirty_ = false;
    } else {
        inheritSides();
    }
    sortOnce(unsettled_);
    // In document order where all is new, so that numbers are.
    for (const std::uint32_t place : unsettled_) settle(place);
    unsettled_.clear();
    inheriting_.clear();
    (void)relations_.takeChanged();
    settleBodies(aspect);
    if (changes.environments) findGravity(aspect);
}

bool ObjectHandler::beyondLimits() const {
    return interestsLeftOut_ > 0 || relations_.size() > limits_.maxGroups;
}

/// What leaves who takes part, and with whom, as it is.
void ObjectHandler::applyTerms(const Aspect& aspect, const SceneEffects& effects) {
    for (const std::span<const ObjectId> rows : effects.objectTerms)
        for (const ObjectId id : rows) {
            const std::uint32_t number = objects_.find(id);
            if (number == IdTable::kNone) continue;
            const CollisionObject& core = *aspect.get<CollisionObject>(id);
            for (const std::uint32_t body : objects_.at(number).bodies) copyTerms(core, body);
        }
    if (!effects.interestTerms.empty()) {
        const std::vector<InterestTerms> before = interests_;
        for (const std::span<const ObjectId> rows : effects.interestTerms)
            for (const ObjectId id : rows) {
                const std::uint32_t number = interestNumbers_.find(id);
                if (number >= interests_.size()) continue;
                const Interest& core = *aspect.get<Interest>(id);
                interests_[number] = {id,        core.response, core.mode, core.detail, core.threshold,
                                      core.show, core.patience};
            }
        relations_.setTerms(interests_);
        ++interestsVersion_;
        noteReworded(before);
    }
    for (const std::span<const ObjectId> rows : effects.shapes)
        for (const ObjectId id : rows) {
            const std::uint32_t number = tree_.bearersOf(id);
            if (number == VisibleTree::kNone) continue;
            for (std::uint32_t place = tree_.bearers()[number].first; place != VisibleTree::kNone;
                 place = tree_.nextBearer(place)) {
                noteDrawn(place);
                if (standings_[place].part != kNobody) touchedParts_.push_back(standings_[place].part);
            }
        }
    if (effects.surroundings) findGravity(aspect);
}

void ObjectHandler::findGravity(const Aspect& aspect) {
    std::uint32_t first = VisibleTree::kNone;
    ObjectId core;
    for (const ObjectId id : tree_.environments()) {
        const std::uint32_t place = tree_.firstBearer(tree_.bearersOf(id));
        if (first != VisibleTree::kNone && !tree_.order().before(place, first)) continue;
        first = place;
        core = id;
    }
    gravity_ = core ? aspect.get<Environment>(core)->gravity : Vec3d(Vec3d::Zero());
}

void ObjectHandler::endUpdate() {
    for (const std::uint32_t place : tree_.changes().gone) {
        const bool drawn = standings_[place].drawn;
        standings_[place] = {};
        standings_[place].drawn = drawn;
    }
    tree_.recycle();
    objects_.recycle();
    freeParts_.insert(freeParts_.end(), partsGone_.begin(), partsGone_.end());
    partsGone_.clear();
}

// ---- questions

Relation ObjectHandler::relation(std::uint32_t a, std::uint32_t b) const {
    if (parts_[a].body == parts_[b].body) return {};
    if (!before(a, b)) std::swap(a, b);
    const InteractionTable& table = relations_.interactions();
    return relations_.relation(table.groupOf[a], table.groupOf[b]);
}

std::vector<std::uint32_t> ObjectHandler::placesOf(ObjectId transform) const {
    const std::uint32_t number = transformNumber(transform, ~std::uint32_t{0});
    if (number == kNobody) return {};
    return tree_.sortedBearers(number);
}

ObjectId ObjectHandler::bearerOf(ObjectId core) const {
    const std::uint32_t number = core ? tree_.bearersOf(core) : VisibleTree::kNone;
    if (number == VisibleTree::kNone || tree_.bearers()[number].count != 1) return {};
    return tree_.at(tree_.bearers()[number].first).node;
}

std::uint32_t ObjectHandler::transformNumber(ObjectId transform, std::uint32_t guess) const {
    if (!transform) return kNobody;
    if (guess < tree_.bearers().size() && tree_.bearers()[guess].core == transform) return guess;
    const std::uint32_t number = tree_.bearersOf(transform);
    return number != VisibleTree::kNone && tree_.bearers()[number].kind == CoreKind::kTransform ? number : kNobody;
}

bool ObjectHandler::carriesParts(std::uint32_t number) const {
    for (std::uint32_t place = tree_.bearers()[number].first; place != VisibleTree::kNone;
         place = tree_.nextBearer(place))
        if (tree_.at(place).parts > 0) return true;
    return false;
}

std::uint32_t ObjectHandler::freeBodyOf(ObjectId transform) const {
    const std::uint32_t number = transformNumber(transform, ~std::uint32_t{0});
    return number == kNobody ? kNobody : freeBodyOf(number);
}

std::uint32_t ObjectHandler::freeBodyOf(std::uint32_t number) const {
    const VisibleTree::Bearers& all = tree_.bearers()[number];
    if (all.count != 1) return kNobody;
    const std::uint32_t body = standings_[all.first].body;
    return body != kNobody && bodies_[body].free() ? body : kNobody;
}

}  // namespace tessera
