#include "common/scene/InverseRecorder.h"

#include <algorithm>

namespace tessera {

InverseRecorder::InverseRecorder(const ChangeList& list, const ObjectTable& table) {
    IdMap<Nothing> placed;
    if (!list.creations.empty() && !list.destructions.empty())
        for (const Placement& p : list.placements) {
            placed.add(p.node);
            placed.add(p.parent);
        }
    if (!list.ranges.empty())
        for (const FieldColumn& column : list.columns)
            if (column.kind() == FieldKind::kBlob)
                for (const ObjectId id : column.ids) wholes_.insert({id, column.field});
    for (const Creation& creation : list.creations) created_.add(creation.id);
    for (const ObjectId id : list.destructions) destroyed_.add(id);

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

FieldColumn& InverseRecorder::columnFor(const FieldColumn& column, const FieldEntry& field) {
    for (FieldColumn& known : inverse_.columns)
        if (known.type == column.type && known.field == column.field) return known;
    FieldColumn& fresh =
        inverse_.columns.emplace_back(FieldColumn::ofShape(column.type, column.field, field.kind, field.width));
    fresh.ids.reserve(column.ids.size());
    std::visit([&](auto& values) { values.reserve(column.ids.size() * field.width); }, fresh.values);
    return fresh;
}

void InverseRecorder::overwritten(const FieldColumn& column, const FieldEntry& field, std::size_t first,
                                  std::span<std::byte* const> objects) {
    FieldColumn& old = columnFor(column, field);
    const std::span ids = std::span(column.ids).subspan(first, objects.size());
    if ((!created_.empty() || !destroyed_.empty()) &&
        std::ranges::any_of(ids, [&](ObjectId id) { return comesOrGoes(id); })) {
        for (std::size_t row = 0; row < objects.size(); ++row)
            if (!comesOrGoes(ids[row])) old.append(ids[row], field.read(objects[row]));
        return;
    }
    old.ids.insert(old.ids.end(), ids.begin(), ids.end());
    std::visit(
        [&](auto& values) {
            using Scalar = typename std::decay_t<decltype(values)>::value_type;
            if constexpr (std::is_same_v<Scalar, float> || std::is_same_v<Scalar, double>) {
                const std::size_t end = values.size(), width = field.width;
                values.resize(end + objects.size() * width);
                Scalar* to = &values[end];
                for (const std::byte* object : objects) {
                    const Scalar* at = field.in<Scalar>(object);
                    // A quaternion lies as x y z w and is said as w x y z.
                    if (field.quaternion) to[0] = at[3];
                    std::copy_n(at, field.quaternion ? 3 : width, field.quaternion ? to + 1 : to);
                    to += width;
                }
            } else if constexpr (std::is_same_v<Scalar, std::uint8_t>) {
                for (const std::byte* object : objects) values.push_back(*field.in<bool>(object));
            } else {
                for (const std::byte* object : objects) values.push_back(*field.in<Scalar>(object));
            }
        },
        old.values);
}

void InverseRecorder::edited(const RangeEdit& range, const Blob& before) {
    if (created_.contains(range.object) || destroyed_.contains(range.object)) return;
    const std::pair key{range.object, range.field};
    if (wholes_.contains(key)) return;
    if (before.resident()) {
        // By its name: a history of edits is no history of arrays.
        inverse_.ranges.push_back({range.object, range.type, range.field, range.offset,
                                   Blob(before.values<std::byte>(range.offset, range.bytes.sizeBytes())),
                                   Blob::absent(before.id(), before.sizeBytes())});
    } else {
        wholes_.insert(key);
        lost_.set(range.object, range.type, range.field, before);
    }
}

ChangeList InverseRecorder::take() {
    std::erase_if(inverse_.columns, [](const FieldColumn& column) { return column.ids.empty(); });
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
