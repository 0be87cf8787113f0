#include "server/collision/objects/SceneEffects.h"

#include <algorithm>

#include "common/scene/FieldTable.h"

namespace tessera {

namespace {

/// Where a column's rows go; null: they mean nothing for collisions.
SceneEffects::Rows* rowsFor(SceneEffects& effects, const FieldColumn& column) {
    if (column.type == typeOf<Node>()) return column.field == field::kNodeCore ? &effects.cores : nullptr;
    if (column.type == typeOf<Switch>()) return &effects.choices;
    if (column.type == typeOf<Transform>()) return &effects.poses;
    if (column.type == typeOf<Geometry>())
        return column.field == field::kPositions || column.field == field::kIndices ? &effects.shapes : nullptr;
    if (column.type == typeOf<CollisionObject>()) {
        const bool terms = column.field == field::kMass || column.field == field::kRestitution ||
                           column.field == field::kFriction || column.field == field::kVelocity ||
                           column.field == field::kSpin;
        return terms ? &effects.objectTerms : &effects.objectRules;
    }
    if (column.type == typeOf<Interest>()) {
        const bool terms = column.field == field::kInterestResponse || column.field == field::kInterestDetail ||
                           column.field == field::kInterestThreshold || column.field == field::kInterestShow ||
                           column.field == field::kInterestPatience;
        return terms ? &effects.interestTerms : &effects.interestRules;
    }
    return nullptr;
}

}  // namespace

SceneEffects effectsOf(const ChangeList& list) {
    SceneEffects effects;
    effects.placements = list.placements;
    const SceneEffects::Rows* rowsBefore = nullptr;
    for (const FieldColumn& column : list.columns) {
        if (column.type == typeOf<Environment>()) effects.surroundings = true;
        SceneEffects::Rows* const rows = rowsFor(effects, column);
        // Whoever moves sets translation, rotation and scale: of columns with the same rows one is enough, since all of
        // the object is read.
        const bool known = rows && rows == rowsBefore && std::ranges::equal(rows->back(), column.ids);
        if (rows && !known && !column.ids.empty()) rows->emplace_back(column.ids);
        rowsBefore = rows && !rows->empty() ? rows : nullptr;
    }
    return effects;
}

}  // namespace tessera
