#include "server/sim/commit/ServersNodes.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>
#include <unordered_set>
#include <vector>

#include "common/cores/Geometry.h"
#include "common/cores/Text.h"
#include "common/scene/FieldTable.h"
#include "common/scene/ServerNodes.h"

namespace tessera {
namespace {

constexpr std::string_view kNobodyRefers = "nothing else may refer to them";
constexpr std::string_view kNobodyHangs = "what hangs there would go with them";
constexpr std::string_view kNobodyChanges = "nobody else changes them";

std::string nameOf(ObjectId id) {
    return isPlaceholder(id) ? std::string("a new object") : fmt::format("#{}", id.value);
}

/// "#12 (Interest): its object".
std::string fieldOf(const FieldColumn& column, std::size_t row) {
    const TypeInfo* type = findType(column.type);
    const FieldEntry* field = type ? findField(*type, column.field) : nullptr;
    return fmt::format("{} ({}): its {}", nameOf(column.ids[row]), type ? type->name : "?",
                       field ? field->name : "field");
}

}  // namespace

void ServersNodes::sceneChanged(const Aspect& scene, const ChangeList* list) {
    const auto note = [&](ObjectId id) {
        const Node* node = scene.get<Node>(id);
        if (node && node->ofServer)
            named_.insert(id);
        else
            named_.erase(id);
    };
    if (!list) {
        named_.clear();
        for (const ObjectId id : scene.ids()) note(id);
        stale_ = true;
        return;
    }
    for (const FieldColumn& column : list->columns) {
        if (column.type != typeOf<Node>()) continue;
        stale_ = true;
        if (column.field == fieldId<&Node::ofServer>)
            for (const ObjectId id : column.ids) note(id);
    }
    if (!named_.empty())
        for (const ObjectId id : list->destructions) named_.erase(id);
    stale_ = stale_ || !list->placements.empty() || !list->destructions.empty();
}

void ServersNodes::gather(const Aspect& scene) {
    ours_.clear();
    for (const ObjectId top : named_) {
        std::vector<ObjectId> open{top};
        while (!open.empty()) {
            const ObjectId id = open.back();
            open.pop_back();
            if (!ours_.try_emplace(id, top).second) continue;
            const Object object = scene.find(id);
            if (const Node* node = object.as<Node>()) {
                open.insert(open.end(), node->children.begin(), node->children.end());
                if (node->core) open.push_back(node->core);
            } else if (const Geometry* geometry = object.as<Geometry>(); geometry && geometry->material) {
                open.push_back(geometry->material);
            } else if (const Text* text = object.as<Text>(); text && text->material) {
                open.push_back(text->material);
            }
        }
    }
}

Error ServersNodes::refusal(const Aspect& scene, ObjectId ours, const std::string& what, std::string_view why) const {
    const Node& top = *scene.get<Node>(ours_.at(ours));
    const std::string belongs = top.name == kHandlesName ? fmt::format("the handles of {}", pathOf(scene, top.parent))
                                : top.name == kContactsName ? std::string("the marks of contacts")
                                                            : std::string("the notices of programs");
    return {ErrorCode::kRefused,
            fmt::format("{} #{}, which is of {}: the server makes those and takes them away, and {}", what, ours.value,
                        belongs, why)};
}

Expected<void> ServersNodes::check(const Aspect& scene, const ChangeList& list) {
    for (const FieldColumn& column : list.columns) {
        if (column.type != typeOf<Node>() || column.field != fieldId<&Node::ofServer>) continue;
        for (std::size_t row = 0; row < column.ids.size(); ++row)
            if (const Node* node = scene.get<Node>(column.ids[row]);
                column.value(row) != FieldValue(node && node->ofServer))
                return fail(ErrorCode::kRefused,
                            fmt::format("{}: the server alone says the ofServer of a Node", nameOf(column.ids[row])));
    }
    if (named_.empty()) return {};
    if (stale_) gather(scene);
    stale_ = false;
    if (ours_.empty()) return {};

    std::optional<std::unordered_set<ObjectId>> destroyed;
    const auto goesWithItsBearer = [&](ObjectId id) {
        if (!destroyed) destroyed.emplace(list.destructions.begin(), list.destructions.end());
        const Node& top = *scene.get<Node>(ours_.at(id));
        return top.name == kHandlesName && destroyed->contains(top.parent);
    };
    const auto isOurs = [&](ObjectId id) { return ours_.contains(id); };
    for (const Placement& placement : list.placements) {
        if (isOurs(placement.parent))
            return tl::unexpected(
                refusal(scene, placement.parent, nameOf(placement.node) + " would come below", kNobodyHangs));
        if (isOurs(placement.node) && (placement.parent || !goesWithItsBearer(placement.node)))
            return tl::unexpected(
                refusal(scene, placement.node, placement.parent ? "this moves" : "this takes away", kNobodyChanges));
    }
    for (const FieldColumn& column : list.columns) {
        const auto* refs = std::get_if<std::vector<ObjectId>>(&column.values);
        const auto* lists = std::get_if<std::vector<RefList>>(&column.values);
        for (std::size_t row = 0; row < column.ids.size(); ++row) {
            if (isOurs(column.ids[row]))
                return tl::unexpected(refusal(scene, column.ids[row], "this changes", kNobodyChanges));
            if (refs && row < refs->size() && isOurs((*refs)[row]))
                return tl::unexpected(refusal(scene, (*refs)[row], fieldOf(column, row) + " would be", kNobodyRefers));
            if (!lists || row >= lists->size()) continue;
            const auto held = std::ranges::find_if((*lists)[row], isOurs);
            if (held != (*lists)[row].end())
                return tl::unexpected(refusal(scene, *held, fieldOf(column, row) + " would hold", kNobodyRefers));
        }
    }
    for (const RangeEdit& range : list.ranges)
        if (isOurs(range.object)) return tl::unexpected(refusal(scene, range.object, "this changes", kNobodyChanges));
    for (const ObjectId id : list.destructions)
        if (isOurs(id) && !goesWithItsBearer(id))
            return tl::unexpected(refusal(scene, id, "this takes away", kNobodyChanges));
    return {};
}

}  // namespace tessera
