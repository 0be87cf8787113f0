#include "server/rules/ManipulatorCheck.h"

#include <algorithm>
#include <map>
#include <optional>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <variant>

#include <fmt/format.h>

#include "common/cores/Manipulator.h"
#include "common/scene/FieldTable.h"

namespace tessera {
namespace {

/// The types of the cores that some nodes have once the list is applied. Costs the list once, and the nodes.
std::unordered_map<ObjectId, ObjectType> coreTypesAfter(const Aspect& scene, const ChangeList& list,
                                                        const std::unordered_set<ObjectId>& nodes) {
    std::unordered_map<ObjectId, ObjectId> cores;
    for (const ObjectId node : nodes)
        if (const Node* present = scene.get<Node>(node)) cores[node] = present->core;
    for (const FieldColumn& column : list.columns) {
        if (column.type != typeOf<Node>() || column.field != fieldId<&Node::core>) continue;
        const auto* refs = std::get_if<std::vector<ObjectId>>(&column.values);
        for (std::size_t row = 0; refs != nullptr && row < std::min(refs->size(), column.ids.size()); ++row)
            if (nodes.contains(column.ids[row])) cores[column.ids[row]] = (*refs)[row];
    }
    std::unordered_map<ObjectId, ObjectType> created;
    for (const auto& [node, core] : cores) created.emplace(core, ObjectType());
    for (const Creation& creation : list.creations)
        if (const auto wanted = created.find(creation.id); wanted != created.end()) wanted->second = creation.type;
    std::unordered_map<ObjectId, ObjectType> types;
    for (const auto& [node, core] : cores) {
        const Object object = scene.find(core);
        types[node] = object ? object.info().type : created.at(core);
    }
    return types;
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
            return core == typeOf<Transform>() || core == typeOf<ComponentTransform>()
                       ? ""
                       : "a Transform or ComponentTransform";
    }
}

}  // namespace

Sound checkManipulators(const Aspect& scene, const ChangeList& list) {
    std::map<ObjectId, Manipulator> touched;
    for (const FieldColumn& column : list.columns) {
        const bool target = column.field == fieldId<&Manipulator::target>,
                   kind = column.field == fieldId<&Manipulator::kind>;
        if (column.type != typeOf<Manipulator>() || (!target && !kind) || column.scalarCount() != column.ids.size())
            continue;
        for (std::size_t row = 0; row < column.ids.size(); ++row) {
            const Manipulator* present = scene.get<Manipulator>(column.ids[row]);
            Manipulator& draft = touched.try_emplace(column.ids[row], present ? *present : Manipulator()).first->second;
            const FieldValue value = column.value(row);
            if (const auto* ref = std::get_if<ObjectId>(&value); ref && target) draft.target = *ref;
            if (const auto* number = std::get_if<std::int64_t>(&value); number && kind) draft.kind = *number;
        }
    }
    for (const ObjectId id : list.destructions) touched.erase(id);
    std::unordered_set<ObjectId> targets;
    for (const auto& [id, manipulator] : touched)
        if (manipulator.target) targets.insert(manipulator.target);
    if (targets.empty()) return {};
    const std::unordered_map<ObjectId, ObjectType> types = coreTypesAfter(scene, list, targets);
    for (const auto& [id, manipulator] : touched) {
        if (!manipulator.target) continue;
        const auto known = types.find(manipulator.target);
        const ObjectType core = known == types.end() ? ObjectType() : known->second;
        const std::string_view wanted = wantedBy(manipulator.kind, core);
        if (wanted.empty()) continue;
        const TypeInfo* is = findType(core);
        const FieldEntry* field = findField(*findType(typeOf<Manipulator>()), fieldId<&Manipulator::kind>);
        return tl::unexpected(
            Fault{id,
                  typeOf<Manipulator>(),
                  {ErrorCode::kBadInput, fmt::format("its target has {}; '{}' wants a node whose core is {}",
                                                     is ? fmt::format("the core {}", is->name) : std::string("no core"),
                                                     wordOfNumber(*field, manipulator.kind).value_or("?"), wanted)}});
    }
    return {};
}

}  // namespace tessera
