#include "server/sim/commit/ServersFields.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "common/cores/Inline.h"
#include "common/cores/Manipulator.h"
#include "common/cores/Movie.h"
#include "common/cores/Node.h"
#include "common/cores/ProxyGroup.h"
#include "common/cores/SurfaceParts.h"
#include "common/scene/FieldTable.h"

namespace tessera {
namespace {

struct ServersField {
    ObjectType type;
    FieldId field;
    std::string_view instead;
};

constexpr std::array kServersFields = {
    ServersField{typeOf<SurfaceProgram>(), fieldId<&SurfaceProgram::verdict>, "it follows from the program's text"},
    ServersField{typeOf<SurfaceProgram>(), fieldId<&SurfaceProgram::problem>, "it follows from the program's text"},
    ServersField{typeOf<Movie>(), fieldId<&Movie::problem>, "it follows from the film's file"},
    ServersField{typeOf<Manipulator>(), fieldId<&Manipulator::held>, "grab the handle"},
    ServersField{typeOf<Manipulator>(), fieldId<&Manipulator::sizes>, "set its pixels"},
    ServersField{typeOf<Manipulator>(), fieldId<&Manipulator::moreSizes>, "set its pixels"},
};

constexpr std::array kOfTheRunningScene = {
    std::pair{typeOf<Inline>(), fieldId<&Inline::state>},         std::pair{typeOf<Inline>(), fieldId<&Inline::problem>},
    std::pair{typeOf<ProxyGroup>(), fieldId<&ProxyGroup::state>}, std::pair{typeOf<ProxyGroup>(), fieldId<&ProxyGroup::problem>},
    std::pair{typeOf<Node>(), fieldId<&Node::levels>},            std::pair{typeOf<Node>(), fieldId<&Node::ofServer>},
};

}  // namespace

bool isServersField(ObjectType type, FieldId field) {
    return std::ranges::any_of(kServersFields, [&](const ServersField& f) { return f.type == type && f.field == field; }) ||
           std::ranges::find(kOfTheRunningScene, std::pair(type, field)) != kOfTheRunningScene.end();
}

Expected<void> checkServersFields(const Aspect& scene, const ChangeList& list) {
    for (const FieldColumn& column : list.columns) {
        const auto known = std::ranges::find_if(kServersFields, [&](const ServersField& f) { return f.type == column.type && f.field == column.field; });
        if (known == kServersFields.end()) continue;
        const FieldEntry* field = findField(*findType(column.type), column.field);
        // The scene refuses in words what is no such value, and what is no such object.
        if (column.kind() != field->kind || column.scalarCount() != column.ids.size() * field->width) continue;
        for (std::size_t row = 0; row < column.ids.size(); ++row) {
            const Object object = scene.find(column.ids[row]);
            if (!object || object.info().type != column.type || field->load(object) == column.value(row)) continue;
            return fail(ErrorCode::kRefused,
                        fmt::format("#{}: the server alone says the {} of a {}; {}", column.ids[row].value, field->name, object.info().name, known->instead));
        }
    }
    return {};
}

}  // namespace tessera
