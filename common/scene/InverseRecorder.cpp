#include "common/scene/InverseRecorder.h"

#include <algorithm>

namespace tessera {

InverseRecorder::InverseRecorder(const ChangeList& list, const ObjectTable& table) {
    std::unordered_set<ObjectId> placed;
    if (!list.creations.empty() && !list.destructions.empty())
        for (const Placement& p : list.placements) {
            placed.insert(p.node);
            placed.insert(p.parent);
        }
    if (!list.ranges.empty())
        for (const FieldColumn& column : list.columns)
            if (column.kind() == FieldKind::kBlob)
                for (const ObjectId id : column.ids) wholes_.insert({id, column.field});
    for (const Creation& creation : list.creations) created_.insert(creation.id);
    for (const ObjectId id : list.destructions) destroyed_.insert(id);

    for (const ObjectId id : list.destructions) {
        if (const ObjectTable::Slot* slot = table.find(id)) {
            const Object object = table.object(*slot);
            inverse_.creations.push_back({id, typeOf(object)});
            setAllFields(lost_, id, object);
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

void InverseRecorder::overwritten(const FieldColumn& column, const FieldEntry& field, std::span<std::byte* const> objects) {
    FieldColumn old = FieldColumn::ofShape(column.type, column.field, field.kind, field.width);
    const auto comesOrGoes = [&](ObjectId id) { return created_.contains(id) || destroyed_.contains(id); };
    if ((!created_.empty() || !destroyed_.empty()) && std::any_of(column.ids.begin(), column.ids.end(), comesOrGoes)) {
        for (std::size_t row = 0; row < objects.size(); ++row)
            if (!comesOrGoes(column.ids[row])) old.append(column.ids[row], field.read(objects[row]));
    } else {
        old.ids = column.ids;
        std::visit(
            [&](auto& values) {
                using Scalar = typename std::decay_t<decltype(values)>::value_type;
                values.reserve(objects.size() * field.width);
                for (const std::byte* object : objects) {
                    if constexpr (std::is_same_v<Scalar, std::uint8_t>) {
                        values.push_back(*field.in<bool>(object));
                    } else {
                        const Scalar* at = field.in<Scalar>(object);
                        if (field.quaternion) values.push_back(at[3]);  // lies as x y z w, is said as w x y z
                        for (std::size_t i = 0; i < (field.quaternion ? 3u : field.width); ++i) values.push_back(at[i]);
                    }
                }
            },
            old.values);
    }
    if (!old.ids.empty()) inverse_.columns.push_back(std::move(old));
}

void InverseRecorder::edited(const RangeEdit& range, const Blob& before) {
    if (created_.contains(range.object) || destroyed_.contains(range.object)) return;
    const std::pair key{range.object, range.field};
    if (wholes_.contains(key)) return;
    if (before.resident()) {
        const ByteSpan old = before.bytes().subspan(range.offset, range.bytes.sizeBytes());
        inverse_.ranges.push_back(
            {range.object, range.type, range.field, range.offset, Blob(Bytes(old.begin(), old.end())), before});
    } else {
        wholes_.insert(key);
        lost_.set(range.object, range.type, range.field, before);
    }
}

ChangeList InverseRecorder::take() {
    std::reverse(inverse_.placements.begin(), inverse_.placements.end());
    std::reverse(inverse_.ranges.begin(), inverse_.ranges.end());
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
