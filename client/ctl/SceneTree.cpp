#include "client/ctl/SceneTree.h"

#include <fmt/format.h>

#include "client/ctl/FieldText.h"
#include "client/ctl/Answer.h"
#include "common/scene/FieldTable.h"

namespace tessera {

namespace {

void addLines(std::string& text, const Aspect& aspect, ObjectId id, int depth, std::size_t indent) {
    const Node& node = *aspect.get<Node>(id);
    text.append(2 * indent, ' ');
    text += id == kRootNode ? "/" : node.name.empty() ? "(unnamed)" : node.name;
    if (node.core) text += fmt::format("  {}", aspect.find(node.core).info().name);
    if (const auto* transform = aspect.coreOf<Transform>(node))
        text += fmt::format(" at {}", textOf(toValue(transform->translation)));
    text += fmt::format("  #{}", id.value);
    if (depth == 0 && !node.children.empty()) text += fmt::format("  ({} below)", node.children.size());
    text += '\n';
    if (depth == 0) return;
    for (const ObjectId child : node.children) addLines(text, aspect, child, depth - 1, indent + 1);
}

}  // namespace

std::string treeText(const Aspect& aspect, ObjectId node, int depth) {
    std::string text;
    addLines(text, aspect, node, depth, 0);
    return text;
}

nlohmann::ordered_json treeJson(const Aspect& aspect, ObjectId id, int depth) {
    const Node& node = *aspect.get<Node>(id);
    nlohmann::ordered_json json = {{"id", id.value}, {"name", node.name}, {"path", pathOf(aspect, id)}};
    if (node.core) {
        const Object core = aspect.find(node.core);
        nlohmann::ordered_json fields = {{"id", node.core.value}, {"type", core.info().name}};
        for (const FieldEntry& field : core.info().fields)
            fields[std::string(field.name)] = valueJson(field.load(core));
        json["core"] = std::move(fields);
    }
    if (depth == 0) {
        json["children_below"] = node.children.size();
        return json;
    }
    json["children"] = nlohmann::ordered_json::array();
    for (const ObjectId child : node.children) json["children"].push_back(treeJson(aspect, child, depth - 1));
    return json;
}

}  // namespace tessera
