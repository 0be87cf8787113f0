#include "common/scene/InverseRecorder.h"

#include <algorithm>

#include "common/scene/FieldLayout.h"

namespace tessera {

namespace {

/// Copies the present values of a column's rows out of their objects, by kind and without a FieldValue in between.
template <typename Scalar>
void gather(const FieldColumn& column, const FieldInfo& field, const ObjectTable& table, FieldColumn& out) {
    ObjectTable::ConstCursor cursor(table);
    auto& values = std::get<std::vector<Scalar>>(out.values);
    values.reserve(column.ids.size() * field.width);
    if (column.ids.empty()) return;
    const FieldLayout& layout = layoutOf(cursor.find(column.ids.front())->alternative, field.id);
    for (const ObjectId id : column.ids) {
        const Scalar* at = layout.in<Scalar>(std::as_const(*cursor.find(id)->object));
        if (field.quaternion) values.push_back(at[3]);  // lies as x y z w, is said as w x y z
        for (std::size_t i = 0; i < (field.quaternion ? 3u : field.width); ++i) values.push_back(at[i]);
    }
}

}  // namespace

void setAllFields(ChangeListBuilder& list, ObjectId id, const Object& object) {
    const TypeInfo& type = typeInfo(object);
    const Object fresh = type.make();
    for (const FieldInfo& field : type.fields) {
        const FieldValue value = field.load(object);
        if (value != field.load(fresh)) list.set(id, type.type, field.id, value);
    }
}

InverseRecorder::InverseRecorder(const ChangeList& list, const ObjectTable& table) {
    std::unordered_set<ObjectId> placed;
    if (!list.creations.empty() && !list.destructions.empty())
        for (const Placement& p : list.placements) {
            placed.insert(p.node);
            placed.insert(p.parent);
        }
    for (const Creation& creation : list.creations) created_.insert(creation.id);
    for (const ObjectId id : list.destructions) destroyed_.insert(id);

    for (const ObjectId id : list.destructions) {
        if (const ObjectTable::Slot* slot = table.find(id)) {
            inverse_.creations.push_back({id, typeOf(*slot->object)});
            setAllFields(lost_, id, *slot->object);
        } else if (placed.contains(id)) {
            inverse_.creations.push_back({id, typeOf<Node>()});
        }
    }
    for (const Creation& creation : list.creations)
        if (!destroyed_.contains(creation.id) || placed.contains(creation.id))
            inverse_.destructions.push_back(creation.id);
}

void InverseRecorder::moved(ObjectId node, ObjectId parent, std::uint32_t index) {
    inverse_.placements.push_back({node, parent, parent ? index : Placement::kLast});
}

void InverseRecorder::overwritten(const FieldColumn& column, const FieldInfo& field, const ObjectTable& table) {
    FieldColumn old = FieldColumn::ofShape(column.type, column.field, field.kind, field.width);
    const auto comesOrGoes = [&](ObjectId id) { return created_.contains(id) || destroyed_.contains(id); };
    if ((!created_.empty() || !destroyed_.empty()) && std::any_of(column.ids.begin(), column.ids.end(), comesOrGoes)) {
        for (const ObjectId id : column.ids)
            if (!comesOrGoes(id)) old.append(id, field.load(*table.find(id)->object));
    } else {
        old.ids = column.ids;
        switch (field.kind) {
            case FieldKind::kFloat:
                gather<float>(column, field, table, old);
                break;
            case FieldKind::kDouble:
                gather<double>(column, field, table, old);
                break;
            case FieldKind::kInt:
                gather<std::int64_t>(column, field, table, old);
                break;
            case FieldKind::kRef:
                gather<ObjectId>(column, field, table, old);
                break;
            case FieldKind::kText:
                gather<std::string>(column, field, table, old);
                break;
            case FieldKind::kBlob:
                gather<Blob>(column, field, table, old);
                break;
        }
    }
    if (!old.ids.empty()) inverse_.columns.push_back(std::move(old));
}

ChangeList InverseRecorder::take() {
    std::reverse(inverse_.placements.begin(), inverse_.placements.end());
    // A column of survivors and one of the destroyed may be the same column.
    for (FieldColumn& lost : lost_.take().columns) {
        const auto same = std::find_if(
            inverse_.columns.begin(), inverse_.columns.end(),
            [&](const FieldColumn& column) { return column.type == lost.type && column.field == lost.field; });
        if (same == inverse_.columns.end()) {
            inverse_.columns.push_back(std::move(lost));
        } else {
            for (std::size_t row = 0; row < lost.ids.size(); ++row) same->append(lost.ids[row], lost.value(row));
        }
    }
    return std::move(inverse_);
}

}  // namespace tessera
