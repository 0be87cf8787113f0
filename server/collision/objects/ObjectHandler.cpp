#include "server/collision/objects/ObjectHandler.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "common/scene/FieldTable.h"
#include "server/collision/objects/ConservativeBox.h"

namespace tessera {

namespace {

bool sameBits(const Affine3d& a, const Affine3d& b) {
    return std::memcmp(a.data(), b.data(), 16 * sizeof(double)) == 0;
}

/// Whether a map keeps shapes but for one scale, and does not mirror them. Products of a hundred rotations do.
bool rigidButForScale(const Affine3d& m) {
    constexpr double kTolerance = 1e-9;
    const Mat3d gram = m.linear().transpose() * m.linear();
    const double scale = gram.trace() / 3;
    if (!std::isfinite(scale) || !(scale > 0)) return false;
    return (gram - scale * Mat3d::Identity()).cwiseAbs().maxCoeff() <= kTolerance * scale &&
           m.linear().determinant() > 0;
}

}  // namespace

bool invertible(const Affine3d& m) {
    // Nearly always: coefficients of the inverse, cofactors over the determinant, are then below 1e26. Not so a NaN.
    constexpr double kUsual = 1e6;
    const double determinant = m.linear().determinant();
    if (m.matrix().cwiseAbs().maxCoeff<Eigen::PropagateNaN>() < kUsual && std::abs(determinant) > 1 / kUsual)
        return true;
    if (!m.matrix().allFinite()) return false;
    const Affine3d inverse = m.inverse();
    return inverse.matrix().allFinite() && std::abs(determinant) > 1e-120 && m.matrix().cwiseAbs().maxCoeff() < 1e50 &&
           inverse.matrix().cwiseAbs().maxCoeff() < 1e50;
}

// ---- following the scene

void ObjectHandler::update(const Aspect& aspect, const ChangeList* list) {
    if (!list || changesTables(*list)) {
        rebuild(aspect, list == nullptr);
        return;
    }
    const FieldColumn* before = nullptr;
    for (const FieldColumn& column : list->columns) {
        // Whoever moves sets translation, rotation and scale: of columns with the same rows one is enough, since all of
        // the object is read. Not so of geometries, where the field matters.
        const bool known =
            before && column.type != typeOf<Geometry>() && column.type == before->type && column.ids == before->ids;
        if (!known) applyColumn(aspect, column);
        before = &column;
    }
    // What was laid over the scene is now committed, or was refused.
    reloadTouched(aspect);
    if (termsChanged_) relations_.refresh(interests_);
    termsChanged_ = false;
    if (deformed_) listDeformations();
    findFreeBodies();
}

/// Creations and destructions alone do not: what is not placed is not visible, and what is visible is not destroyed.
bool ObjectHandler::changesTables(const ChangeList& list) const {
    if (!list.placements.empty()) return true;
    const auto changes = [&](const FieldColumn& column) {
        const auto any = [&](auto&& concerns) { return std::any_of(column.ids.begin(), column.ids.end(), concerns); };
        if (column.type == typeOf<Node>()) return column.field == field::kNodeCore;
        if (column.type == typeOf<Switch>())
            return any([&](ObjectId id) { return tree_.switches.find(id) != IdTable::kNone; });
        if (column.type == typeOf<Interest>()) {
            if (column.field == field::kInterestResponse || column.field == field::kInterestDetail ||
                column.field == field::kInterestThreshold || column.field == field::kInterestShow ||
                column.field == field::kInterestPatience)
                return false;
            const bool enables = column.field == field::kInterestEnabled;
            return any([&](ObjectId id) {
                const std::uint32_t number = interestNumbers_.find(id);
                return number != IdTable::kNone && (enables || number != kDisabled);
            });
        }
        if (column.type == typeOf<CollisionObject>()) {
            if (column.field == field::kMass || column.field == field::kRestitution ||
                column.field == field::kFriction || column.field == field::kVelocity || column.field == field::kSpin)
                return false;
            return any([&](ObjectId id) { return objectNumbers_.find(id) != IdTable::kNone; });
        }
        return false;
    };
    return std::any_of(list.columns.begin(), list.columns.end(), changes);
}

/// A column that leaves the tables as they are.
void ObjectHandler::applyColumn(const Aspect& aspect, const FieldColumn& column) {
    if (column.type == typeOf<Transform>()) {
        for (const ObjectId id : column.ids) touch(id);
    } else if (column.type == typeOf<CollisionObject>()) {
        for (const ObjectId id : column.ids) {
            const std::uint32_t number = objectNumbers_.find(id);
            if (number == IdTable::kNone) continue;
            const CollisionObject& core = *aspect.get<CollisionObject>(id);
            for (const std::uint32_t body : bodiesOfObject_[number]) copyTerms(core, body);
        }
    } else if (column.type == typeOf<Interest>()) {
        for (const ObjectId id : column.ids) {
            const std::uint32_t number = interestNumbers_.find(id);
            if (number >= interests_.size()) continue;
            const Interest& core = *aspect.get<Interest>(id);
            interests_[number] = {id, core.response, core.mode, core.detail, core.threshold, core.show, core.patience};
            termsChanged_ = true;
        }
    } else if (column.type == typeOf<Geometry>()) {
        if (column.field != field::kPositions && column.field != field::kIndices) return;
        for (const ObjectId id : column.ids) {
            const std::uint32_t number = geometries_.find(id);
            if (number == IdTable::kNone) continue;
            for (const std::uint32_t part : partsOfGeometry_[number]) {
                std::shared_ptr<const CollisionShape> shape = shapeOf(aspect, part, false);
                if (shape == parts_[part].shape) continue;
                parts_[part].shape = std::move(shape);
                reshapePart(part);
            }
        }
    } else if (column.type == typeOf<Environment>()) {
        if (tree_.environment) gravity_ = aspect.get<Environment>(tree_.environment)->gravity;
    }
}

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
        if (core.enabled == 0) {
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
    if (core.kind == CollisionObject::kRigid && core.division == CollisionObject::kWhole && carrier) {
        const std::uint32_t transform = tree_.transformNumbers.find(carrier);
        if (tree_.placesOf(transform).size() == 1) {
            bodyTerms_.back().transform = transform;
            candidates_.push_back(number);
            if (tree_.places[place].parent != Place::kNone) aboveCandidate_[tree_.places[place].parent] = true;
        }
    }
    copyTerms(core, number);
}

/// What can change without the tables being made anew.
void ObjectHandler::copyTerms(const CollisionObject& core, std::uint32_t body) {
    Body& mine = bodies_[body];
    mine.restitution = core.restitution;
    mine.friction = core.friction;
    mine.velocity = core.velocity;
    mine.spin = core.spin;
    const double mass = bodyTerms_[body].transform != kNobody ? core.mass : 0;
    freedomChanged_ = freedomChanged_ || mass != bodyTerms_[body].mass;
    bodyTerms_[body].mass = mass;
}

std::shared_ptr<const CollisionShape> ObjectHandler::shapeOf(const Aspect& aspect, std::uint32_t part, bool jump) {
    const Geometry& geometry = *aspect.get<Geometry>(geometryOfPart_[part]);
    switch (bodyTerms_[parts_[part].body].shape) {
        case BodyShape::kTriangles:
            return shapes_->shape(geometry);
        case BodyShape::kHull:
            return shapes_->shape(geometry, ShapeKind::kHull);
        case BodyShape::kDeforming:
            break;
    }
    deformed_ = true;
    return deforming_.follow(geometryOfPart_[part], geometry, jump);
}

/// Gives all parts their shapes and poses; what has stayed keeps its pose version.
void ObjectHandler::shapeParts(const Aspect& aspect, bool jump) {
    moved_.assign(parts_.size(), false);
    movedCount_ = 0;
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
    movedCount_ = parts_.size();
    std::sort(deformingCores.begin(), deformingCores.end());
    deforming_.keepOnly(deformingCores);
    listDeformations();
}

// ---- poses

void ObjectHandler::overlay(ObjectId transform, const Affine3d& local) {
    const std::uint32_t number = tree_.transformNumbers.find(transform);
    if (number == IdTable::kNone) return;
    if (!carriers_[number].overlaid) {
        carriers_[number].overlaid = true;
        overlaid_.push_back(number);
    }
    std::uint32_t done = 0;  // a place below one that was just moved is right already
    const std::span<const std::uint32_t> mine = tree_.placesOf(number);
    if (sameBits(tree_.places[mine.front()].local, local)) return;
    for (const std::uint32_t index : mine) tree_.places[index].local = local;
    for (const std::uint32_t index : mine) {
        if (index < done) continue;
        done = tree_.places[index].end;
        movePlacesBelow(index);
    }
    findFreeBodies();
}

void ObjectHandler::dropOverlay(const Aspect& aspect) {
    reloadTouched(aspect);
    findFreeBodies();
}

void ObjectHandler::touch(ObjectId transform) {
    const std::uint32_t number = tree_.transformNumbers.find(transform);
    if (number == IdTable::kNone || carriers_[number].touched) return;
    carriers_[number].touched = true;
    touched_.push_back(number);
}

/// Gives the touched and the overlaid transforms the scene's values, and moves what is below those that had others.
void ObjectHandler::reloadTouched(const Aspect& aspect) {
    for (const std::uint32_t number : overlaid_) {
        carriers_[number].overlaid = false;
        if (carriers_[number].touched) continue;
        carriers_[number].touched = true;
        touched_.push_back(number);
    }
    overlaid_.clear();
    for (const std::uint32_t number : touched_) {
        carriers_[number].touched = false;
        const Transform& t = *aspect.get<Transform>(tree_.transforms[number]);
        const Affine3d local = composeTransform(t.translation, t.rotation, t.scale);
        const std::span<const std::uint32_t> mine = tree_.placesOf(number);
        if (sameBits(tree_.places[mine.front()].local, local)) continue;
        for (const std::uint32_t index : mine) {
            tree_.places[index].local = local;
            movedPlaces_.push_back(index);
        }
    }
    touched_.clear();
    moveTouched();
}

void ObjectHandler::moveTouched() {
    // From the top down, so that nothing is moved twice.
    if (!std::is_sorted(movedPlaces_.begin(), movedPlaces_.end())) std::sort(movedPlaces_.begin(), movedPlaces_.end());
    std::uint32_t done = 0;
    for (const std::uint32_t index : movedPlaces_) {
        if (index < done) continue;
        done = tree_.places[index].end;
        movePlacesBelow(index);
    }
    movedPlaces_.clear();
}

void ObjectHandler::movePlacesBelow(std::uint32_t index) {
    static const Affine3d kTop = Affine3d::Identity();
    const std::uint32_t end = tree_.places[index].end;
    for (std::uint32_t i = index; i < end; ++i) {
        Place& p = tree_.places[i];
        const Affine3d& above = p.parent == Place::kNone ? kTop : tree_.places[p.parent].world;
        if (p.transform)
            p.world = above * p.local;
        else
            p.world = above;
        if (aboveCandidate_[i]) freedomChanged_ = true;
        if (firstPart_[i + 1] != firstPart_[i]) movePart(firstPart_[i]);
    }
}

void ObjectHandler::movePart(std::uint32_t part) {
    const Affine3d& world = tree_.places[parts_[part].place].world;
    if (sameBits(parts_[part].world, world)) return;
    parts_[part].world = world;
    reshapePart(part);
}

/// The part's pose or its shape is another one.
void ObjectHandler::reshapePart(std::uint32_t number) {
    Part& part = parts_[number];
    const bool wasSolid = part.solid();
    part.worldBox =
        part.shape && invertible(part.world) ? boxAround(part.world, part.shape->tree.mesh().bounds()) : Box{};
    part.poseVersion = nextVersion_++;
    if (part.solid() != wasSolid) freedomChanged_ = true;
    if (moved_[number]) return;
    moved_[number] = true;
    ++movedCount_;
}

std::vector<std::uint32_t> ObjectHandler::takeMoved() {
    std::vector<std::uint32_t> moved;
    moved.reserve(movedCount_);
    for (std::uint32_t i = 0; i < moved_.size() && moved.size() < movedCount_; ++i) {
        if (!moved_[i]) continue;
        moved.push_back(i);
        moved_[i] = false;
    }
    movedCount_ = 0;
    return moved;
}

/// All conditions of CollisionObject::mass that poses and shapes decide; the others have chosen the candidates.
void ObjectHandler::findFreeBodies() {
    if (!freedomChanged_) return;
    freedomChanged_ = false;
    std::uint32_t above = Place::kNone;  // the place looked at last
    bool rigid = true;
    std::uint32_t freeUpTo = 0;  // places before this one are at or below a free body
    for (const std::uint32_t number : candidates_) {
        Body& body = bodies_[number];
        const std::uint32_t parent = tree_.places[body.place].parent;
        if (parent != above) rigid = parent == Place::kNone || rigidButForScale(tree_.places[parent].world);
        above = parent;
        const bool solid =
            std::any_of(body.parts.begin(), body.parts.end(), [&](std::uint32_t p) { return parts_[p].solid(); });
        const double mass = bodyTerms_[number].mass;
        const bool free = mass > 0 && rigid && solid && body.place >= freeUpTo;
        body.mass = free ? mass : 0;
        body.transform = free ? tree_.places[body.place].transform : ObjectId{};
        carriers_[bodyTerms_[number].transform].freeBody = free ? number : kNobody;
        if (free) freeUpTo = tree_.places[body.place].end;
    }
}

// ---- deformation

void ObjectHandler::listDeformations() {
    deformed_ = false;
    deformations_.clear();
    for (const std::uint32_t part : deformingParts_)
        if (const std::vector<Vec3d>* end = deforming_.endOf(geometryOfPart_[part]))
            deformations_.push_back({part, *end});
}

void ObjectHandler::settleDeformations() {
    if (deformations_.empty()) return;
    deforming_.settle();
    for (const Deformation& deformation : deformations_) reshapePart(deformation.part);
    deformations_.clear();
    findFreeBodies();
}

// ---- questions

Relation ObjectHandler::relation(std::uint32_t a, std::uint32_t b) const {
    if (a > b) std::swap(a, b);
    if (parts_[a].body == parts_[b].body) return {};
    return relations_.relation(a, b);
}

std::span<const std::uint32_t> ObjectHandler::placesOf(ObjectId transform) const {
    const std::uint32_t number = tree_.transformNumbers.find(transform);
    if (number == IdTable::kNone) return {};
    return tree_.placesOf(number);
}

std::uint32_t ObjectHandler::freeBodyOf(ObjectId transform) const {
    const std::uint32_t number = tree_.transformNumbers.find(transform);
    return number == IdTable::kNone ? kNobody : carriers_[number].freeBody;
}

std::size_t ObjectHandler::partsSkipped() const {
    return static_cast<std::size_t>(
        std::count_if(parts_.begin(), parts_.end(), [](const Part& p) { return !p.solid(); }));
}

}  // namespace tessera
