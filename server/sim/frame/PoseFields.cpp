#include "server/sim/frame/PoseFields.h"

#include <algorithm>
#include <array>
#include <span>
#include <utility>

#include "common/cores/Transform.h"
#include "common/scene/FieldTable.h"

namespace tessera {

bool isPoseField(const FieldColumn& column) {
    return column.type == typeOf<Transform>() &&
           (column.field == fieldId<&Transform::translation> || column.field == fieldId<&Transform::rotation> ||
            column.field == fieldId<&Transform::scale>);
}

Pose poseOf(const Transform& t) {
    return {.translation = t.translation, .rotation = t.rotation, .scale = t.scale};
}

void setPart(Pose& pose, const FieldColumn& column, std::size_t row) {
    const std::array<double, 4> v = std::get<Doubles>(column.value(row)).values;
    if (column.field == fieldId<&Transform::translation>) pose.translation = Vec3d(v[0], v[1], v[2]);
    if (column.field == fieldId<&Transform::rotation>) pose.rotation = Quatd(v[0], v[1], v[2], v[3]);
    if (column.field == fieldId<&Transform::scale>) pose.scale = Vec3d(v[0], v[1], v[2]);
}

void addPose(ChangeListBuilder& builder, ObjectId id, const Pose& from, const Pose& to) {
    const ObjectType type = typeOf<Transform>();
    if (to.translation != from.translation)
        builder.set(id, type, fieldId<&Transform::translation>, toValue(to.translation));
    if (to.rotation.coeffs() != from.rotation.coeffs())
        builder.set(id, type, fieldId<&Transform::rotation>, toValue(to.rotation));
    if (to.scale != from.scale) builder.set(id, type, fieldId<&Transform::scale>, toValue(to.scale));
}

void mergeColumn(ChangeList& list, FieldColumn column) {
    const auto order = [](const FieldColumn& c) { return std::pair(c.type, c.field); };
    const auto same = std::ranges::find(list.columns, order(column), order);
    if (same == list.columns.end()) {
        list.columns.insert(std::ranges::upper_bound(list.columns, order(column), {}, order), std::move(column));
        return;
    }
    for (std::size_t row = 0; row < column.ids.size(); ++row) same->append(column.ids[row], column.value(row));
}

namespace {

bool isThere(const Aspect& scene, const Placement& placement) {
    const Node* node = scene.get<Node>(placement.node);
    if (!node || node->parent != placement.parent) return false;
    if (!placement.parent) return true;
    const ChildList& siblings = scene.get<Node>(placement.parent)->children;
    const std::size_t at = siblings.indexOf(placement.node);
    return placement.index == Placement::kLast ? at + 1 == siblings.size() : placement.index == at;
}

/// Of one node the last place alone counts; of several each has to stand where it is put.
bool leaveAllInPlace(const Aspect& scene, std::span<const Placement> placements) {
    if (placements.empty()) return true;
    const ObjectId first = placements.front().node;
    if (std::ranges::all_of(placements, [&](const Placement& placement) { return placement.node == first; }))
        placements = placements.last(1);
    return std::ranges::all_of(placements, [&](const Placement& placement) { return isThere(scene, placement); });
}

}  // namespace

bool saysNothing(const Aspect& scene, const ChangeList& inverse) {
    if (!inverse.creations.empty() || !inverse.destructions.empty()) return false;
    if (!leaveAllInPlace(scene, inverse.placements)) return false;
    const auto isSo = [&](ObjectId id, ObjectType type, FieldId field, const FieldValue& value) {
        const Object object = scene.find(id);
        const FieldEntry* entry = object && object.info().type == type ? findField(object.info(), field) : nullptr;
        return entry && entry->load(object) == value;
    };
    for (const FieldColumn& column : inverse.columns)
        for (std::size_t row = 0; row < column.ids.size(); ++row)
            if (!isSo(column.ids[row], column.type, column.field, column.value(row))) return false;
    return std::ranges::all_of(inverse.ranges, [&](const RangeEdit& range) {
        return isSo(range.object, range.type, range.field, range.result);
    });
}

}  // namespace tessera
