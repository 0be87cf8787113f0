#include "server/collision/objects/ObjectHandler.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/scene/FieldTable.h"
#include "server/collision/objects/ConservativeBox.h"

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
    const CollisionShape& shape = *part.shape;
    const Box& bounds = shape.tree.mesh().bounds();
    return shape.hull ? boxAround(part.world, bounds, shape.ballCentre, shape.ballRadius) : boxAround(part.world, bounds);
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
    for (const RangeEdit& range : list->ranges) {
        FieldColumn touched = FieldColumn::ofShape(range.type, range.field, FieldKind::kBlob, 1);
        touched.ids = {range.object};
        applyColumn(aspect, touched);
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
        if (column.type == typeOf<Node>()) return column.field == fieldId<&Node::core>;
        if (column.type == typeOf<Switch>())
            return any([&](ObjectId id) { return tree_.switches.find(id) != IdTable::kNone; });
        if (column.type == typeOf<Interest>()) {
            if (column.field == fieldId<&Interest::response> || column.field == fieldId<&Interest::detail> ||
                column.field == fieldId<&Interest::threshold> || column.field == fieldId<&Interest::show> ||
                column.field == fieldId<&Interest::patience>)
                return false;
            const bool enables = column.field == fieldId<&Interest::enabled>;
            return any([&](ObjectId id) {
                const std::uint32_t number = interestNumbers_.find(id);
                return number != IdTable::kNone && (enables || number != kDisabled);
            });
        }
        if (column.type == typeOf<CollisionObject>()) {
            if (column.field == fieldId<&CollisionObject::mass> || column.field == fieldId<&CollisionObject::restitution> ||
                column.field == fieldId<&CollisionObject::friction> || column.field == fieldId<&CollisionObject::velocity> || column.field == fieldId<&CollisionObject::spin>)
                return false;
            return any([&](ObjectId id) { return objectNumbers_.find(id) != IdTable::kNone; });
        }
        return false;
    };
    return std::any_of(list.columns.begin(), list.columns.end(), changes);
}

/// A column that leaves the tables as they are.
void ObjectHandler::applyColumn(const Aspect& aspect, const FieldColumn& column) {
    if (effectsOf(column) & Effect::kPose) {
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
        if (column.field != fieldId<&Geometry::positions> && column.field != fieldId<&Geometry::indices>) return;
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

/// What can change without the tables being made anew.
void ObjectHandler::copyTerms(const CollisionObject& core, std::uint32_t body) {
    Body& mine = bodies_[body];
    mine.restitution = core.restitution;
    mine.friction = core.friction;
    mine.velocity = core.velocity;
    mine.spin = core.spin;
    const double mass = bodyTerms_[body].transform != kNobody ? core.mass : 0;
    if (mine.free()) ++freeBodiesVersion_;
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

// ---- poses

void ObjectHandler::overlay(ObjectId transform, const Affine3d& local) {
    const std::uint32_t number = tree_.transformNumbers.find(transform);
    if (number != IdTable::kNone) overlay(number, local);
}

void ObjectHandler::overlay(std::uint32_t number, const Affine3d& local) {
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
        const Object core = aspect.find(tree_.transforms[number]);
        const Affine3d local = core.info().pose(core.data()).matrix;
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
        p.world = p.below(above);
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
    part.worldBox = boxOf(part);
    part.poseVersion = nextVersion_++;
    if (part.solid() != wasSolid) {
        freedomChanged_ = true;
        if (wasSolid)
            ++skipped_;
        else
            --skipped_;
    }
    if (bodies_[part.body].free()) ++freeBodiesVersion_;
    if (moved_[number]) return;
    moved_[number] = true;
    movedParts_.push_back(number);
}

std::vector<std::uint32_t> ObjectHandler::takeMoved() {
    for (const std::uint32_t part : movedParts_) moved_[part] = false;
    if (!std::is_sorted(movedParts_.begin(), movedParts_.end())) std::sort(movedParts_.begin(), movedParts_.end());
    return std::exchange(movedParts_, {});
}

/// All conditions of CollisionObject::mass that poses and shapes decide; the others have chosen the candidates.
void ObjectHandler::findFreeBodies() {
    if (!freedomChanged_) return;
    freedomChanged_ = false;
    std::uint32_t above = Place::kNone;  // the place looked at last
    bool rigid = true;
    std::uint32_t freeUpTo = 0;  // places before this one are at or below a free body
    ++freeBodiesVersion_;
    freeBodies_.clear();
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
        if (!free) continue;
        freeUpTo = tree_.places[body.place].end;
        freeBodies_.push_back(number);
    }
    std::sort(freeBodies_.begin(), freeBodies_.end());
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

std::uint32_t ObjectHandler::transformNumber(ObjectId transform, std::uint32_t guess) const {
    if (guess < tree_.transforms.size() && tree_.transforms[guess] == transform) return guess;
    const std::uint32_t number = tree_.transformNumbers.find(transform);
    return number == IdTable::kNone ? kNobody : number;
}

std::uint32_t ObjectHandler::freeBodyOf(ObjectId transform) const {
    const std::uint32_t number = tree_.transformNumbers.find(transform);
    return number == IdTable::kNone ? kNobody : carriers_[number].freeBody;
}

}  // namespace tessera
