/// The part of the object handler that keeps parts, their shapes, and the bodies that they make.
#include <algorithm>
#include <array>
#include <utility>

#include "common/drawable/Drawable.h"
#include "server/collision/objects/ObjectHandler.h"
#include "server/collision/objects/SortOnce.h"
#include "server/collision/pairwise/ConservativeBox.h"
#include "server/collision/pairwise/PairTable.h"

namespace tessera {

namespace {

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
    standIns_.erase(number);
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
        noteStandIn(number, shape.get());
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
    const Drawable drawable = drawableOf(aspect, core);
    const MeshArrays arrays = drawable.meetsNobody() ? MeshArrays() : drawable.arrays();
    if (partTerms_[part].shape.deforms) return deforming_.follow(deformingKey(part), arrays, jump, drawable);
    return shapes_->shape(arrays, partTerms_[part].shape.choice, drawable);
}

namespace {

/// Balls that cover it stand for triangles and for height fields alike.
bool isAsAsked(const CollisionShape& shape, const ShapeChoice& choice) {
    if (shape.isCover()) return true;
    return choice.level == 0 && (!choice.representation || *choice.representation == shape.representation());
}

}  // namespace

std::string_view ObjectHandler::askedShape(std::uint32_t part) const {
    static constexpr std::array<std::string_view, kFinestLevel> kLevels{"level 1", "level 2",  "level 3",  "level 4",
                                                                        "level 5", "level 6",  "level 7",  "level 8",
                                                                        "level 9", "level 10", "level 11", "level 12"};
    const ShapeChoice& choice = partTerms_[part].shape.choice;
    const bool otherShape = choice.representation && *choice.representation != parts_[part].shape->representation();
    if (otherShape || choice.level == 0) return nameOf(*choice.representation);
    return kLevels[choice.level - 1];
}

void ObjectHandler::noteStandIn(std::uint32_t number, const CollisionShape* shape) {
    if (shape != nullptr && !isAsAsked(*shape, partTerms_[number].shape.choice))
        standIns_.insert(number);
    else
        standIns_.erase(number);
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
        if (const DeformingShapes::End* end = deforming_.endOf(deformingKey(part)))
            deformations_.push_back({part, end->first, end->positions});
}

void ObjectHandler::settleDeformations() {
    if (deformations_.empty()) return;
    deforming_.settle();
    for (const PartDeformation& deformation : deformations_) {
        reshapePart(deformation.part);
        noteDrawn(parts_[deformation.part].place);
    }
    deformations_.clear();
    findFreeBodies();
}

}  // namespace tessera
