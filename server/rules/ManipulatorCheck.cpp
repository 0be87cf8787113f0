#include "server/rules/ManipulatorCheck.h"

#include <algorithm>
#include <map>
#include <optional>
#include <string_view>
#include <variant>

#include <fmt/format.h>

#include "common/scene/FieldTable.h"

namespace tessera {
namespace {

/// The core that a node has once the list is applied, and its type.
ObjectType coreTypeAfter(const Aspect& scene, const ChangeList& list, ObjectId node) {
    const Node* present = scene.get<Node>(node);
    ObjectId core = present ? present->core : ObjectId();
    for (const FieldColumn& column : list.columns) {
        if (column.type != typeOf<Node>() || column.field != fieldId<&Node::core>) continue;
        const auto* refs = std::get_if<std::vector<ObjectId>>(&column.values);
        const auto row = std::ranges::find(column.ids, node);
        if (refs && row != column.ids.end() && refs->size() == column.ids.size()) core = (*refs)[static_cast<std::size_t>(row - column.ids.begin())];
    }
    if (const Object object = scene.find(core)) return object.info().type;
    const auto creation = std::ranges::find(list.creations, core, &Creation::id);
    return creation == list.creations.end() ? ObjectType() : creation->type;
}

std::string_view wantedBy(std::int64_t kind, ObjectType core) {
    switch (kind) {
        case Manipulator::kCenterball:
            return core == typeOf<ComponentTransform>() ? "" : "a ComponentTransform, which has a centre";
        case Manipulator::kPointLight:
            return core == typeOf<PointLight>() ? "" : "a PointLight";
        case Manipulator::kDirectionalLight:
            return core == typeOf<DirectionalLight>() ? "" : "a DirectionalLight";
        case Manipulator::kSpotLight:
            return core == typeOf<SpotLight>() ? "" : "a SpotLight";
        default:
            return core == typeOf<Transform>() || core == typeOf<ComponentTransform>() ? "" : "a Transform or ComponentTransform";
    }
}

}  // namespace

Sound checkManipulators(const Aspect& scene, const ChangeList& list) {
    std::map<ObjectId, Manipulator> touched;
    for (const FieldColumn& column : list.columns) {
        const bool target = column.field == fieldId<&Manipulator::target>, kind = column.field == fieldId<&Manipulator::kind>;
        if (column.type != typeOf<Manipulator>() || (!target && !kind) || column.scalarCount() != column.ids.size()) continue;
        for (std::size_t row = 0; row < column.ids.size(); ++row) {
            const Manipulator* present = scene.get<Manipulator>(column.ids[row]);
            Manipulator& draft = touched.try_emplace(column.ids[row], present ? *present : Manipulator()).first->second;
            const FieldValue value = column.value(row);
            if (const auto* ref = std::get_if<ObjectId>(&value); ref && target) draft.target = *ref;
            if (const auto* number = std::get_if<std::int64_t>(&value); number && kind) draft.kind = *number;
        }
    }
    for (const auto& [id, manipulator] : touched) {
        if (!manipulator.target || std::ranges::find(list.destructions, id) != list.destructions.end()) continue;
        const ObjectType core = coreTypeAfter(scene, list, manipulator.target);
        const std::string_view wanted = wantedBy(manipulator.kind, core);
        if (wanted.empty()) continue;
        const TypeInfo* is = findType(core);
        const FieldEntry* field = findField(*findType(typeOf<Manipulator>()), fieldId<&Manipulator::kind>);
        return tl::unexpected(Fault{id, typeOf<Manipulator>(),
                                    {ErrorCode::kBadInput, fmt::format("its target has {}; '{}' wants a node whose core is {}",
                                                                       is ? fmt::format("the core {}", is->name) : std::string("no core"),
                                                                       wordOfNumber(*field, manipulator.kind).value_or("?"), wanted)}});
    }
    return {};
}

}  // namespace tessera
