#include "server/collision/objects/SceneEffects.h"

#include <algorithm>
#include <unordered_set>

#include "common/cores/Node.h"
#include "common/scene/FieldTable.h"

namespace tessera {

namespace {

/// Where the rows of a field go; null: they mean nothing for collisions.
SceneEffects::Rows* rowsFor(SceneEffects& effects, ObjectType type, FieldId field) {
    // What users see of levels of detail: collisions look at the first.
    if (type == typeOf<DistanceLOD>() || (type == typeOf<Node>() && field == fieldId<&Node::levels>)) return nullptr;
    const Effect what = effectsOf(type, field);
    if (what & Effect::kStructure) return &effects.cores;
    if (what & Effect::kVisibility) return &effects.choices;
    if (what & Effect::kPose) return &effects.poses;
    if (what & Effect::kShape) return &effects.shapes;
    // Who has rules and terms are the two cores that this folder is about.
    if (type == typeOf<CollisionObject>()) return what & Effect::kRules ? &effects.objectRules : &effects.objectTerms;
    if (type == typeOf<Interest>()) return what & Effect::kRules ? &effects.interestRules : &effects.interestTerms;
    return nullptr;
}

}  // namespace

SceneEffects sceneEffectsOf(const ChangeList& list) {
    SceneEffects effects;
    effects.placements = list.placements;
    const SceneEffects::Rows* rowsBefore = nullptr;
    for (const FieldColumn& column : list.columns) {
        if (column.type == typeOf<Environment>()) effects.surroundings = true;
        SceneEffects::Rows* const rows = rowsFor(effects, column.type, column.field);
        // Whoever moves sets translation, rotation and scale: of columns with the same rows one is enough, since all of
        // the object is read.
        const bool known = rows && rows == rowsBefore && std::ranges::equal(rows->back(), column.ids);
        if (rows && !known && !column.ids.empty()) rows->emplace_back(column.ids);
        rowsBefore = rows && !rows->empty() ? rows : nullptr;
    }
    for (const RangeEdit& range : list.ranges)
        if (SceneEffects::Rows* const rows = rowsFor(effects, range.type, range.field))
            rows->emplace_back(&range.object, 1);
    return effects;
}

bool changesRules(const ChangeList& list) {
    std::unordered_set<ObjectId> created;
    for (const FieldColumn& column : list.columns) {
        if (!(effectsOf(column) & Effect::kRules)) continue;
        if (created.empty())
            for (const Creation& creation : list.creations) created.insert(creation.id);
        if (!std::ranges::all_of(column.ids, [&](ObjectId id) { return created.contains(id); })) return true;
    }
    return false;
}

}  // namespace tessera
