#include "client/ctl/SceneTree.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "client/ctl/Answer.h"
#include "client/ctl/FieldText.h"
#include "common/cores/Transform.h"
#include "common/scene/Aspect.h"
#include "common/scene/FieldTable.h"

namespace tessera {

namespace {

void addLines(std::string& text, const SceneExcerpt& tree, ObjectId id, int depth, std::size_t indent) {
    const Node& node = *tree.get<Node>(id);
    text.append(2 * indent, ' ');
    text += id == kRootNode ? "/" : node.name.empty() ? "(unnamed)" : node.name;
    const Object core = tree.coreOf(id);
    if (core) text += fmt::format("  {}", core.info().name);
    if (const auto* transform = core.as<Transform>()) {
        const Vec3d at = withoutNoise(transform->translation);
        text += fmt::format(" at {} {} {}", readable(at.x()), readable(at.y()), readable(at.z()));
    }
    text += fmt::format("  #{}", id.value);
    if (depth == 0 && tree.childCount(id) != 0) text += fmt::format("  ({} below)", tree.childCount(id));
    text += '\n';
    if (depth == 0) return;
    for (const ObjectId child : node.children) addLines(text, tree, child, depth - 1, indent + 1);
}

/// How the children stand in paths below `path`. Below a node that no path can say there is none that could.
std::vector<std::string> childPaths(const SceneExcerpt& tree, const Node& node, const std::string& path) {
    std::vector<std::string_view> names;
    for (const ObjectId child : node.children) names.push_back(tree.get<Node>(child)->name);
    std::vector<std::string> paths = stepsOf(names);
    std::size_t i = 0;
    for (const ObjectId child : node.children) {
        std::string& step = paths[i++];
        const bool said = !step.empty() && path.starts_with('/');
        step = said ? (path == "/" ? "" : path) + "/" + step : numberOf(child);
    }
    return paths;
}

}  // namespace

std::string treeText(const SceneExcerpt& tree, ObjectId node, int depth) {
    std::string text;
    addLines(text, tree, node, depth, 0);
    return text;
}

nlohmann::ordered_json treeJson(const SceneExcerpt& tree, ObjectId id, const std::string& path, int depth) {
    const Node& node = *tree.get<Node>(id);
    nlohmann::ordered_json json = {{"id", id.value}, {"name", node.name}, {"path", path}};
    if (const Object core = tree.coreOf(id)) {
        nlohmann::ordered_json fields = {{"id", node.core.value}, {"type", core.info().name}};
        for (const FieldEntry& field : core.info().fields)
            fields[std::string(field.name)] = valueJson(field.load(core));
        json["core"] = std::move(fields);
    }
    if (depth == 0) {
        json["children_below"] = tree.childCount(id);
        return json;
    }
    json["children"] = nlohmann::ordered_json::array();
    const std::vector<std::string> paths = childPaths(tree, node, path);
    std::size_t i = 0;
    for (const ObjectId child : node.children) json["children"].push_back(treeJson(tree, child, paths[i++], depth - 1));
    return json;
}

}  // namespace tessera
