#include "server/text/TextFields.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "common/scene/FieldTable.h"

namespace tessera {
namespace {

constexpr std::array kSetBy{fieldId<&Text::text>, fieldId<&Text::font>, fieldId<&Text::lineSpacing>,
                            fieldId<&Text::alignment>};

bool isTextColumn(const FieldColumn& column) {
    return column.type == typeOf<Text>();
}

}  // namespace

Expected<void> setTexts(ChangeList& list, const Aspect& scene, Typesetter& typesetter,
                        std::vector<std::string>& notes) {
    if (std::ranges::none_of(list.columns, isTextColumn)) return {};
    std::map<ObjectId, Text> texts;
    const TypeInfo& type = *findType(typeOf<Text>());
    for (const FieldColumn& column : list.columns) {
        if (!isTextColumn(column) || std::ranges::find(kSetBy, column.field) == kSetBy.end()) continue;
        const FieldEntry& field = *findField(type, column.field);
        if (column.kind() != field.kind || column.width != field.width ||
            column.scalarCount() != column.ids.size() * column.width)
            continue;  // the scene refuses it
        for (std::size_t row = 0; row < column.ids.size(); ++row) {
            const Text* present = scene.get<Text>(column.ids[row]);
            Text& text = texts.try_emplace(column.ids[row], present ? *present : Text()).first->second;
            const FieldValue value = column.value(row);
            if (checkValue(field, value)) field.store(&text, value);
        }
    }
    FieldColumn outlines = FieldColumn::ofShape(type.type, fieldId<&Text::outlines>, FieldKind::kBlob, 1);
    const auto known = std::ranges::find_if(list.columns, [](const FieldColumn& column) {
        return isTextColumn(column) && column.field == fieldId<&Text::outlines>;
    });
    for (const auto& [id, text] : texts) {
        if (known != list.columns.end() && std::ranges::find(known->ids, id) != known->ids.end()) continue;
        const Expected<TextOutlines> made = typesetter.set(text, notes);
        if (!made) return failWith(fmt::format("Text #{}", id.value), made.error());
        outlines.append(id, made->toBlob());
    }
    if (outlines.ids.empty()) return {};
    if (known != list.columns.end()) {
        for (std::size_t row = 0; row < outlines.ids.size(); ++row)
            known->append(outlines.ids[row], outlines.value(row));
        return {};
    }
    const auto order = [](const FieldColumn& column) { return std::pair(column.type, column.field); };
    list.columns.insert(std::ranges::upper_bound(list.columns, order(outlines), {}, order), std::move(outlines));
    return {};
}

}  // namespace tessera
