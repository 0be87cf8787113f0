/// The part of the object handler that keeps parts, their shapes, and the bodies that they make.
#include <algorithm>
#include <cmath>
#include <utility>

#include "common/drawable/Drawable.h"
#include "server/collision/objects/ObjectHandler.h"
#include "server/collision/objects/SortOnce.h"
#include "server/collision/pairwise/ConservativeBox.h"

namespace tessera {

namespace {

/// Whether a map keeps shapes but for one scale, and does not mirror them. Products of a hundred rotations do.
bool rigidButForScale(const Affine3d& m) {
    constexpr double kTolerance = 1e-9;
    const Mat3d gram = m.linear().transpose() * m.linear();
    const double scale = gram.trace() / 3;
    if (!std::isfinite(scale) || !(scale > 0)) return false;
    return (gram - scale * Mat3d::Identity()).cwiseAbs().maxCoeff() <= kTolerance * scale &&
           m.linear().determinant() > 0;
}

Box boxOf(const Part& part) {
    if (!part.shape || !invertible(part.world)) return {};
    return part.shape->boxIn(part.world);
}

}  // namespace

// ---- parts

void ObjectHandler::addPart(std::uint32_t place) {
    std::uint32_t number = 0;
    if (freeParts_.empty()) {
        number = static_cast<std::uint32_t>(parts_.size());
        parts_.emplace_back();
        partTerms_.emplace_back();
    } else {
        number = freeParts_.back();
        freeParts_.pop_back();
    }
    Part& part = parts_[number];
    part.node = tree_.at(place).node;
    part.place = place;
    part.body = kNobody;
    part.world = tree_.at(place).world;
    standings_[place].part = number;
    tree_.count(place, 1, 0);
    ++skipped_;  // as long as it has no shape
    touchedParts_.push_back(number);
}

void ObjectHandler::removePart(std::uint32_t number) {
    Part& part = parts_[number];
    PartTerms& terms = partTerms_[number];
    const bool gone = tree_.find(part.node) != part.place;  // and with it whatever is counted there
    if (!gone) tree_.count(part.place, -1, 0);
    leaveBody(number);
    relations_.setPart(number, kNobody, kNobody);
    noteRegrouped(number);
    if (!part.solid()) --skipped_;
    deformingDirty_ = deformingDirty_ || terms.shape.deforms;
    standings_[part.place].part = kNobody;
    part = {};
    terms.geometry = {};
    terms.shape = {};
    partsGone_.push_back(number);
}

/// Makes a part one of a group and of the body whose topmost place this is.
void ObjectHandler::assign(std::uint32_t part, std::uint32_t group, std::uint32_t top) {
    if (standings_[top].body == kNobody) standings_[top].body = makeBody(top);
    const std::uint32_t body = standings_[top].body;
    touchBody(body);
    if (parts_[part].body == body && relations_.interactions().groupOf[part] == group) return;
    leaveBody(part);
    joinBody(part, group, body);
    relations_.setPart(part, group, body);
    noteRegrouped(part);
    touchedParts_.push_back(part);
}

void ObjectHandler::joinBody(std::uint32_t part, std::uint32_t group, std::uint32_t body) {
    Body& mine = bodies_[body];
    partTerms_[part].inBody = static_cast<std::uint32_t>(mine.parts.size());
    mine.parts.push_back(part);
    parts_[part].body = body;
    if (parts_[part].solid()) ++bodyTerms_[body].solids;
    share(body, group, true);
}

void ObjectHandler::leaveBody(std::uint32_t part) {
    const std::uint32_t body = parts_[part].body;
    if (body == kNobody) return;
    Body& mine = bodies_[body];
    const std::uint32_t last = mine.parts.back();
    mine.parts[partTerms_[part].inBody] = last;
    partTerms_[last].inBody = partTerms_[part].inBody;
    mine.parts.pop_back();
    parts_[part].body = kNobody;
    if (parts_[part].solid()) --bodyTerms_[body].solids;
    share(body, relations_.interactions().groupOf[part], false);
    touchBody(body);
}

/// One part more, or less, of a body is in a group.
void ObjectHandler::share(std::uint32_t body, std::uint32_t group, bool comes) {
    std::vector<BodyTerms::Share>& shares = bodyTerms_[body].shares;
    auto mine = std::ranges::find(shares, group, &BodyTerms::Share::group);
    if (mine == shares.end()) {
        shares.push_back({group, 1});
        relations_.countBody(group, body, true);
        return;
    }
    mine->parts += comes ? 1 : ~std::uint32_t{0};
    if (mine->parts > 0) return;
    shares.erase(mine);
    relations_.countBody(group, body, false);
}

// ---- shapes

/// Gives touched parts their shapes; what has stayed keeps its pose version.
void ObjectHandler::shapeParts(const Aspect& aspect, bool jump) {
    sortOnce(touchedParts_);
    for (const std::uint32_t number : touchedParts_) {
        Part& part = parts_[number];
        if (!part.node) continue;
        ++work_.parts;
        PartTerms& terms = partTerms_[number];
        const BodyShape& wanted = bodyTerms_[part.body].shape;
        deformingDirty_ = deformingDirty_ || terms.shape.deforms;
        if (wanted.deforms) {
            if (terms.shape != wanted || terms.geometry != tree_.at(part.place).core) deformingParts_.push_back(number);
            deformingDirty_ = true;
        }
        terms.shape = wanted;
        terms.geometry = tree_.at(part.place).core;
        std::shared_ptr<const CollisionShape> shape = shapeOf(aspect, number, jump);
        // What the part was before everything was made anew, if it was.
        if (const auto before = remembered_.find(part.node); part.poseVersion == 0 && before != remembered_.end() &&
                                                             before->second.shape == shape &&
                                                             sameBits(before->second.world, part.world)) {
            part.shape = std::move(shape);
            part.poseVersion = before->second.poseVersion;
            setBox(number, before->second.worldBox);
            noteMoved(number);
            continue;
        }
        if (part.poseVersion != 0 && shape == part.shape) continue;
        part.shape = std::move(shape);
        reshapePart(number);
    }
    touchedParts_.clear();
    if (deformingDirty_) {
        std::erase_if(deformingParts_,
                      [&](std::uint32_t part) { return !parts_[part].node || !partTerms_[part].shape.deforms; });
        sortOnce(deformingParts_);
        std::vector<DeformingShapes::Key> keys;
        for (const std::uint32_t part : deformingParts_) keys.push_back(deformingKey(part));
        sortOnce(keys);
        deforming_.keepOnly(keys);
        listDeformations();
    }
    deformingDirty_ = false;
}

/// The one place that makes a shape of a drawable.
std::shared_ptr<const CollisionShape> ObjectHandler::shapeOf(const Aspect& aspect, std::uint32_t part, bool jump) {
    const ObjectId core = partTerms_[part].geometry;
    const MeshArrays arrays = drawableOf(aspect, core).arrays();
    if (partTerms_[part].shape.deforms) return deforming_.follow(deformingKey(part), arrays, jump);
    return shapes_->shape(arrays, partTerms_[part].shape.choice);
}

/// The part's pose or its shape is another one.
void ObjectHandler::reshapePart(std::uint32_t number) {
    Part& part = parts_[number];
    part.poseVersion = nextVersion_++;
    setBox(number, boxOf(part));
    noteMoved(number);
}

void ObjectHandler::setBox(std::uint32_t number, const Box& box) {
    Part& part = parts_[number];
    const bool wasSolid = part.solid();
    part.worldBox = box;
    if (part.body == kNobody) return;
    BodyTerms& terms = bodyTerms_[part.body];
    if (bodies_[part.body].free()) noteFree(part.body);
    if (part.solid() == wasSolid) return;
    if (wasSolid) {
        ++skipped_;
        --terms.solids;
    } else {
        --skipped_;
        ++terms.solids;
    }
    if (terms.candidate) candidates_.push_back(part.body);
}

void ObjectHandler::listDeformations() {
    deformations_.clear();
    for (const std::uint32_t part : deformingParts_)
        if (const std::vector<Vec3d>* end = deforming_.endOf(deformingKey(part))) deformations_.push_back({part, *end});
}

void ObjectHandler::settleDeformations() {
    if (deformations_.empty()) return;
    deforming_.settle();
    for (const Deformation& deformation : deformations_) {
        reshapePart(deformation.part);
        noteDrawn(parts_[deformation.part].place);
    }
    deformations_.clear();
    findFreeBodies();
}

// ---- what is asked for once

void ObjectHandler::noteMoved(std::uint32_t part) {
    if (std::exchange(partTerms_[part].moved, true)) return;
    movedParts_.push_back(part);
}

void ObjectHandler::noteRegrouped(std::uint32_t part) {
    if (std::exchange(partTerms_[part].regrouped, true)) return;
    regroupedParts_.push_back(part);
}

/// Of interests that are not what they were before.
void ObjectHandler::noteReworded(std::span<const InterestTerms> before) {
    std::unordered_map<ObjectId, std::uint32_t> numbers;
    for (std::uint32_t k = 0; k < before.size(); ++k) numbers.emplace(before[k].core, k);
    std::vector<bool> reworded(interests_.size(), false);
    bool any = false, inOrder = true;
    std::uint32_t last = 0;
    for (std::uint32_t k = 0; k < interests_.size(); ++k) {
        const auto old = numbers.find(interests_[k].core);
        if (old == numbers.end()) continue;  // its groups have changed
        reworded[k] = !(before[old->second] == interests_[k]);
        any = any || reworded[k];
        inOrder = inOrder && last <= old->second;
        last = old->second;
    }
    // Another one may decide.
    if (!inOrder) reworded.assign(interests_.size(), true);
    if (!any && inOrder) return;
    for (std::uint32_t group = 0; group < relations_.interactions().active.size(); ++group) {
        ++work_.groups;
        const auto concerned = [&](std::uint32_t k) { return reworded[k]; };
        if (std::ranges::none_of(relations_.interestsOf(group), concerned)) continue;
        for (const std::uint32_t place : relations_.members(group))
            if (standings_[place].part != kNobody) noteReworded(standings_[place].part);
    }
}

std::uint32_t ObjectHandler::selfInterestOf(std::uint32_t part) const {
    if (part >= parts_.size() || !parts_[part].node) return kNobody;
    const std::uint32_t group = relations_.interactions().groupOf[part];
    if (group == kNobody) return kNobody;
    for (const std::uint32_t k : relations_.interestsOf(group))
        if (interests_[k].mode == Interest::kSelf) return k;
    return kNobody;
}

std::vector<std::uint32_t> ObjectHandler::partsWithSelfInterest() const {
    std::vector<std::uint32_t> out;
    if (std::ranges::none_of(interests_, [](const InterestTerms& i) { return i.mode == Interest::kSelf; })) return out;
    for (std::uint32_t part = 0; part < parts_.size(); ++part)
        if (selfInterestOf(part) != kNobody) out.push_back(part);
    return out;
}

void ObjectHandler::noteReworded(std::uint32_t part) {
    if (std::exchange(partTerms_[part].reworded, true)) return;
    rewordedParts_.push_back(part);
}

void ObjectHandler::noteDrawn(std::uint32_t place) {
    if (!drawnAsked_ || std::exchange(standings_[place].drawn, true)) return;
    drawn_.push_back(place);
}

void ObjectHandler::noteFree(std::uint32_t body) {
    if (std::exchange(bodyTerms_[body].freeChanged, true)) return;
    freeChanged_.push_back(body);
}

std::vector<std::uint32_t> ObjectHandler::takeFreeChanged() {
    for (const std::uint32_t body : freeChanged_) bodyTerms_[body].freeChanged = false;
    sortOnce(freeChanged_);
    return std::exchange(freeChanged_, {});
}

std::vector<std::uint32_t> ObjectHandler::takeMoved() {
    for (const std::uint32_t part : movedParts_) partTerms_[part].moved = false;
    std::erase_if(movedParts_, [&](std::uint32_t part) { return !parts_[part].node; });
    sortOnce(movedParts_);
    return std::exchange(movedParts_, {});
}

std::vector<std::uint32_t> ObjectHandler::takeRegrouped() {
    for (const std::uint32_t part : regroupedParts_) partTerms_[part].regrouped = false;
    sortOnce(regroupedParts_);
    return std::exchange(regroupedParts_, {});
}

std::vector<std::uint32_t> ObjectHandler::takeReworded() {
    for (const std::uint32_t part : rewordedParts_) partTerms_[part].reworded = false;
    std::erase_if(rewordedParts_, [&](std::uint32_t part) { return !parts_[part].node; });
    sortOnce(rewordedParts_);
    return std::exchange(rewordedParts_, {});
}

std::optional<std::vector<std::uint32_t>> ObjectHandler::takeDrawn() {
    drawnAsked_ = true;
    for (const std::uint32_t place : drawn_) standings_[place].drawn = false;
    if (std::exchange(drawnAll_, false)) {
        drawn_.clear();
        return std::nullopt;
    }
    return std::exchange(drawn_, {});
}

// ---- bodies

std::uint32_t ObjectHandler::makeBody(std::uint32_t place) {
    std::uint32_t number = 0;
    if (freeBodyNumbers_.empty()) {
        number = static_cast<std::uint32_t>(bodies_.size());
        bodies_.emplace_back();
        bodyTerms_.emplace_back();
    } else {
        number = freeBodyNumbers_.back();
        freeBodyNumbers_.pop_back();
    }
    bodies_[number].place = place;
    bodies_[number].node = tree_.at(place).node;
    return number;
}

void ObjectHandler::touchBody(std::uint32_t body) {
    if (std::exchange(bodyTerms_[body].touched, true)) return;
    touchedBodies_.push_back(body);
}

void ObjectHandler::settleBodies(const Aspect& aspect) {
    std::sort(touchedBodies_.begin(), touchedBodies_.end());
    for (const std::uint32_t body : touchedBodies_) {
        bodyTerms_[body].touched = false;
        if (bodies_[body].parts.empty())
            removeBody(body);
        else
            settleBody(aspect, body);
    }
    touchedBodies_.clear();
}

void ObjectHandler::settleBody(const Aspect& aspect, std::uint32_t number) {
    Body& body = bodies_[number];
    BodyTerms& terms = bodyTerms_[number];
    const Place& place = tree_.at(body.place);
    setObject(number, standings_[body.place].object);
    if (body.free()) noteFree(number);
    BodyShape shape;
    bool candidate = false;
    if (terms.object == kNobody) {
        const Body plain;
        body.core = {};
        body.kind = plain.kind;
        body.layers = plain.layers;
        body.restitution = plain.restitution;
        body.friction = plain.friction;
        body.velocity = plain.velocity;
        body.spin = plain.spin;
        terms.mass = 0;
    } else {
        const CollisionObjectTable::Entry& entry = objects_.at(terms.object);
        body.core = entry.core;
        body.kind = entry.kind;
        body.layers = entry.layers;
        shape.choice = entry.choice;
        shape.deforms = entry.kind == CollisionObject::kDeforming;
        candidate = entry.kind == CollisionObject::kRigid && entry.division == CollisionObject::kWhole &&
                    place.transform && place.movable && tree_.bearers()[tree_.bearersOf(place.transform)].count == 1;
    }
    if (shape != terms.shape) touchedParts_.insert(touchedParts_.end(), body.parts.begin(), body.parts.end());
    terms.shape = shape;
    terms.candidate = candidate;
    candidates_.push_back(number);
    if (terms.object != kNobody) copyTerms(*aspect.get<CollisionObject>(body.core), number);
    if (!candidate) return;
    const auto inOrder = [&](std::uint32_t a, std::uint32_t b) { return before(a, b); };
    if (std::is_sorted(body.parts.begin(), body.parts.end(), inOrder)) return;
    std::sort(body.parts.begin(), body.parts.end(), inOrder);
    for (std::uint32_t i = 0; i < body.parts.size(); ++i) partTerms_[body.parts[i]].inBody = i;
}

void ObjectHandler::removeBody(std::uint32_t number) {
    Body& body = bodies_[number];
    if (body.free()) {
        noteFree(number);
        listFree(number, false);
        if (tree_.find(body.node) == body.place) askBelow(body.place);
    }
    setObject(number, kNobody);
    standings_[body.place].body = kNobody;
    body = {};
    bodyTerms_[number] = {};
    freeBodyNumbers_.push_back(number);
}

void ObjectHandler::setObject(std::uint32_t number, std::uint32_t object) {
    BodyTerms& terms = bodyTerms_[number];
    if (terms.object == object) return;
    if (terms.object != kNobody) {
        std::vector<std::uint32_t>& others = objects_.at(terms.object).bodies;
        others[terms.inObject] = others.back();
        bodyTerms_[others.back()].inObject = terms.inObject;
        others.pop_back();
    }
    terms.object = object;
    if (object == kNobody) return;
    std::vector<std::uint32_t>& others = objects_.at(object).bodies;
    terms.inObject = static_cast<std::uint32_t>(others.size());
    others.push_back(number);
}

/// What can change without anybody belonging elsewhere.
void ObjectHandler::copyTerms(const CollisionObject& core, std::uint32_t body) {
    Body& mine = bodies_[body];
    mine.restitution = core.restitution;
    mine.friction = core.friction;
    mine.velocity = core.velocity;
    mine.spin = core.spin;
    const double mass = bodyTerms_[body].candidate ? core.mass : 0;
    if (mine.free()) noteFree(body);
    if (mass != bodyTerms_[body].mass) candidates_.push_back(body);
    bodyTerms_[body].mass = mass;
}

/// All conditions of CollisionObject::mass that poses and shapes decide; the others have chosen the candidates.
bool ObjectHandler::mayBeFree(const Body& body, const BodyTerms& terms) const {
    if (!terms.candidate || !(terms.mass > 0) || terms.solids == 0) return false;
    const std::uint32_t parent = tree_.at(body.place).parent;
    if (parent != Place::kNone && !rigidButForScale(tree_.at(parent).world)) return false;
    for (std::uint32_t at = parent; at != Place::kNone; at = tree_.at(at).parent)
        if (standings_[at].body != kNobody && bodies_[standings_[at].body].free()) return false;
    return true;
}

/// What is below a place may be free now, or no longer.
void ObjectHandler::askBelow(std::uint32_t place) {
    if (tree_.at(place).objects == (standings_[place].isTop ? 1u : 0u)) return;
    tree_.walk(place, [&](std::uint32_t at) {
        ++work_.places;
        const std::uint32_t below = standings_[at].body;
        if (at != place && below != kNobody && bodyTerms_[below].candidate) candidates_.push_back(below);
        return tree_.at(at).objects > 0;
    });
}

void ObjectHandler::findFreeBodies() {
    if (candidates_.empty()) return;
    while (!candidates_.empty()) {
        std::vector<std::uint32_t> asked = std::exchange(candidates_, {});
        sortOnce(asked);
        std::erase_if(asked, [&](std::uint32_t body) { return !bodies_[body].node; });
        // Those above first: what is at or below a free body is not free.
        if (asked.size() > 1)
            std::sort(asked.begin(), asked.end(), [&](std::uint32_t a, std::uint32_t b) {
                return tree_.order().before(bodies_[a].place, bodies_[b].place);
            });
        for (const std::uint32_t number : asked) {
            Body& body = bodies_[number];
            const bool was = body.free(), free = mayBeFree(body, bodyTerms_[number]);
            const double mass = free ? bodyTerms_[number].mass : 0;
            if (mass != body.mass) noteFree(number);
            body.mass = mass;
            body.transform = free ? tree_.at(body.place).transform : ObjectId{};
            if (free == was) continue;
            listFree(number, free);
            askBelow(body.place);
        }
    }
}

void ObjectHandler::listFree(std::uint32_t body, bool free) {
    std::uint32_t& at = bodyTerms_[body].inFree;
    if (free) {
        at = static_cast<std::uint32_t>(freeBodies_.size());
        freeBodies_.push_back(body);
        return;
    }
    bodyTerms_[freeBodies_.back()].inFree = at;
    freeBodies_[at] = freeBodies_.back();
    freeBodies_.pop_back();
    at = kNobody;
}

}  // namespace tessera
