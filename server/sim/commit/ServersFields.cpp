#include "server/sim/commit/ServersFields.h"

#include <fmt/format.h>

#include <string_view>

#include "common/scene/FieldTable.h"
#include "common/scene/WrittenByServer.h"

namespace tessera {

Expected<void> checkServersFields(const Aspect& scene, const ChangeList& list) {
    for (const FieldColumn& column : list.columns) {
        const FieldOfServer* known = fieldOfServer(column.type, column.field);
        if (!known || known->instead.empty()) continue;
        const FieldEntry* field = findField(*findType(column.type), column.field);
        // The scene refuses in words what is no such value, and what is no such object.
        if (column.kind() != field->kind || column.scalarCount() != column.ids.size() * field->width) continue;
        for (std::size_t row = 0; row < column.ids.size(); ++row) {
            const Object object = scene.find(column.ids[row]);
            if (!object || object.info().type != column.type || field->load(object) == column.value(row)) continue;
            const std::string_view type = object.info().name;
            const bool isVowel = std::string_view("AEIOU").find(type.front()) != std::string_view::npos;
            return fail(ErrorCode::kRefused,
                        fmt::format("#{}: the server alone says the {} of {} {}; {}", column.ids[row].value,
                                    field->name, isVowel ? "an" : "a", type, known->instead));
        }
    }
    return {};
}

}  // namespace tessera
