/// The part of the object handler that finds everything anew: who takes part, as whose body, with whom.
#include <algorithm>
#include <numeric>

#include "server/collision/objects/ObjectHandler.h"

namespace tessera {

void ObjectHandler::rebuild(const Aspect& aspect, bool jump) {
    ++generation_;
    tree_.flatten(aspect);
    carriers_.assign(tree_.transforms.size(), {});
    touched_.clear();
    overlaid_.clear();
    movedPlaces_.clear();
    gravity_ = tree_.environment ? aspect.get<Environment>(tree_.environment)->gravity : Vec3d(Vec3d::Zero());

    BodyRules rules(aspect, tree_);
    std::vector<InterestSides> sides = chooseInterests(aspect);
    for (InterestSides& side : sides) {
        if (!side.awake) continue;
        side.oneObject = !rules.anyObjectAt(side.object.begin);
        // To ignore is no wish to see as one.
        if (side.oneObject && !side.ignores) rules.makeObject(side.object.begin);
    }
    rules.finish();
    chooseParts(aspect, rules, sides);
    shapeParts(aspect, jump);
    freedomChanged_ = true;
    findFreeBodies();
    shapes_->forgetIdle();
}

/// Lists the enabled interests that are visible, up to the limit.
std::vector<InterestSides> ObjectHandler::chooseInterests(const Aspect& aspect) {
    interests_.clear();
    interestNumbers_.reset(tree_.interests.size());
    interestsLeftOut_ = 0;
    std::vector<ObjectId> ends;  // two per interest
    for (const ObjectId id : tree_.interests) {
        const Interest& core = *aspect.get<Interest>(id);
        if (!core.enabled) {
            interestNumbers_.insert(id, kDisabled);
        } else if (interests_.size() == limits_.maxInterests) {
            interestNumbers_.insert(id, kLeftOut);
            ++interestsLeftOut_;
        } else {
            interestNumbers_.insert(id, static_cast<std::uint32_t>(interests_.size()));
            interests_.push_back({id, core.response, core.mode, core.detail, core.threshold, core.show, core.patience});
            ends.push_back(core.object);
            ends.push_back(core.against ? core.against : kRootNode);
        }
    }
    const std::vector<std::uint32_t> places = tree_.find(ends);
    std::vector<InterestSides> sides(interests_.size());
    for (std::size_t k = 0; k < sides.size(); ++k) {
        const Interest& core = *aspect.get<Interest>(interests_[k].core);
        InterestSides& side = sides[k];
        side.ignores = core.mode == Interest::kIgnore;
        side.objectLayers = core.objectLayers;
        side.againstLayers = core.againstLayers;
        // A node that is hidden, detached or gone: the interest sleeps.
        const std::uint32_t object = places[2 * k], against = places[2 * k + 1];
        side.awake = object != Place::kNone && against != Place::kNone;
        if (!side.awake) continue;
        side.object = {object, tree_.places[object].end};
        side.against = {against, tree_.places[against].end};
    }
    return sides;
}

void ObjectHandler::chooseParts(const Aspect& aspect, const BodyRules& rules, std::span<const InterestSides> sides) {
    // Neighbours within one body are found for nothing: a body of many parts is a group by itself, so that they are
    // not.
    constexpr std::uint32_t kManyParts = 32;
    constexpr std::size_t kMaxAlone = 64;

    std::vector<InterestItem> items;
    std::vector<std::uint32_t> itemGeometry;
    items.reserve(tree_.geometries.size());
    itemGeometry.reserve(tree_.geometries.size());
    std::vector<std::uint32_t> sizes(tree_.places.size(), 0);  // per topmost place of a body
    for (std::uint32_t g = 0; g < tree_.geometries.size(); ++g) {
        const std::uint32_t place = tree_.geometries[g].place;
        InterestItem item{place, rules.bodyOf(place), false, 1, false};
        if (const std::uint32_t object = rules.objectOf(place); object != BodyRules::kNone) {
            item.object = true;
            item.layers = aspect.get<CollisionObject>(tree_.objects[object])->layers;
            if (item.layers == 0) continue;
        }
        ++sizes[item.body];
        items.push_back(item);
        itemGeometry.push_back(g);
    }
    std::size_t alone = 0;
    for (InterestItem& item : items) {
        std::uint32_t& size = sizes[item.body];
        if (size == kNobody) {
            item.alone = true;
        } else if (size >= kManyParts && alone < std::min(kMaxAlone, limits_.maxGroups / 4)) {
            item.alone = true;
            size = kNobody;  // so it is
            ++alone;
        }
    }
    const std::vector<bool> takesPart = relations_.make(interests_, sides, items, limits_.maxGroups);
    for (std::size_t k = relations_.taken(); k < interests_.size(); ++k)
        interestNumbers_.replace(interests_[k].core, kLeftOut);
    interestsLeftOut_ += interests_.size() - relations_.taken();
    interests_.resize(relations_.taken());

    std::vector<Part> before = std::move(parts_);
    const IdTable partBefore = std::move(partOfNode_);
    parts_.clear();
    partOfNode_ = {};
    partOfNode_.reset(items.size());
    geometryOfPart_.clear();
    bodies_.clear();
    bodyTerms_.clear();
    candidates_.clear();
    aboveCandidate_.assign(tree_.places.size(), false);
    objectNumbers_.reset(tree_.objects.size());
    bodiesOfObject_.assign(tree_.objects.size(), {});
    for (std::uint32_t i = 0; i < tree_.objects.size(); ++i) objectNumbers_.insert(tree_.objects[i], i);
    firstPart_.assign(tree_.places.size() + 1, 0);

    const auto taking = static_cast<std::size_t>(std::count(takesPart.begin(), takesPart.end(), true));
    parts_.reserve(taking);
    bodies_.reserve(taking);
    bodyTerms_.reserve(taking);
    geometryOfPart_.reserve(taking);
    std::vector<std::uint32_t> bodyAt(tree_.places.size(), kNobody);
    for (std::size_t i = 0; i < items.size(); ++i) {
        if (!takesPart[i]) continue;
        const auto number = static_cast<std::uint32_t>(parts_.size());
        Part part;
        part.place = items[i].place;
        part.node = tree_.nodes[part.place];
        std::uint32_t& body = bodyAt[items[i].body];
        if (body == kNobody) {
            body = static_cast<std::uint32_t>(bodies_.size());
            makeBody(aspect, rules, items[i].body);
        }
        part.body = body;
        bodies_[body].parts.push_back(number);
        // What the part was before, if it was; shapeParts tells whether that still holds.
        if (const std::uint32_t old = partBefore.find(part.node); old != IdTable::kNone) {
            part.shape = std::move(before[old].shape);
            part.world = before[old].world;
            part.worldBox = before[old].worldBox;
            part.poseVersion = before[old].poseVersion;
        }
        partOfNode_.insert(part.node, number);
        geometryOfPart_.push_back(tree_.geometries[itemGeometry[i]].core);
        firstPart_[part.place + 1] = 1;
        parts_.push_back(std::move(part));
    }
    for (std::size_t i = 1; i < firstPart_.size(); ++i) firstPart_[i] += firstPart_[i - 1];
    for (std::uint32_t t = 0; t < carriers_.size(); ++t)
        carriers_[t].parts = std::ranges::any_of(tree_.placesOf(t), [&](std::uint32_t place) {
            const auto [first, last] = partsBelow(place);
            return first != last;
        });
    std::sort(candidates_.begin(), candidates_.end(),
              [&](std::uint32_t a, std::uint32_t b) { return bodies_[a].place < bodies_[b].place; });
}

void ObjectHandler::makeBody(const Aspect& aspect, const BodyRules& rules, std::uint32_t place) {
    const auto number = static_cast<std::uint32_t>(bodies_.size());
    Body body;
    body.node = tree_.nodes[place];
    body.place = place;
    BodyTerms terms;
    const std::uint32_t object = rules.objectOf(place);
    bodies_.push_back(std::move(body));
    bodyTerms_.push_back(terms);
    if (object == BodyRules::kNone) return;

    bodiesOfObject_[object].push_back(number);
    Body& mine = bodies_.back();
    mine.core = tree_.objects[object];
    const CollisionObject& core = *aspect.get<CollisionObject>(mine.core);
    mine.kind = core.kind;
    mine.layers = core.layers;
    if (core.kind == CollisionObject::kDeforming)
        bodyTerms_.back().shape = BodyShape::kDeforming;
    else if (core.shape == CollisionObject::kHull)
        bodyTerms_.back().shape = BodyShape::kHull;
    const ObjectId carrier = tree_.places[place].transform;
    if (core.kind == CollisionObject::kRigid && core.division == CollisionObject::kWhole &&
        aspect.get<Transform>(carrier)) {
        const std::uint32_t transform = tree_.transformNumbers.find(carrier);
        if (tree_.placesOf(transform).size() == 1) {
            bodyTerms_.back().transform = transform;
            candidates_.push_back(number);
            if (tree_.places[place].parent != Place::kNone) aboveCandidate_[tree_.places[place].parent] = true;
        }
    }
    copyTerms(core, number);
}

/// Gives all parts their shapes and poses; what has stayed keeps its pose version.
void ObjectHandler::shapeParts(const Aspect& aspect, bool jump) {
    moved_.assign(parts_.size(), false);
    movedParts_.clear();
    geometries_.reset(0);
    partsOfGeometry_.clear();
    deformingParts_.clear();
    std::vector<ObjectId> deformingCores;
    for (std::uint32_t i = 0; i < parts_.size(); ++i) {
        Part& part = parts_[i];
        const auto next = static_cast<std::uint32_t>(partsOfGeometry_.size());
        const std::uint32_t geometry = geometries_.insert(geometryOfPart_[i], next);
        if (geometry == next) partsOfGeometry_.emplace_back();
        partsOfGeometry_[geometry].push_back(i);
        if (bodyTerms_[part.body].shape == BodyShape::kDeforming) {
            deformingParts_.push_back(i);
            deformingCores.push_back(geometryOfPart_[i]);
        }
        std::shared_ptr<const CollisionShape> shape = shapeOf(aspect, i, jump);
        const bool same =
            part.poseVersion != 0 && shape == part.shape && sameBits(part.world, tree_.places[part.place].world);
        part.shape = std::move(shape);
        part.world = tree_.places[part.place].world;
        if (!same) reshapePart(i);
        moved_[i] = true;
    }
    movedParts_.resize(parts_.size());
    std::iota(movedParts_.begin(), movedParts_.end(), 0u);
    skipped_ = static_cast<std::size_t>(
        std::count_if(parts_.begin(), parts_.end(), [](const Part& p) { return !p.solid(); }));
    std::sort(deformingCores.begin(), deformingCores.end());
    deforming_.keepOnly(deformingCores);
    listDeformations();
}

}  // namespace tessera
