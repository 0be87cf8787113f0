#include "client/ctl/InlineVerbs.h"

#include <fmt/format.h>

#include "client/ctl/SceneNames.h"
#include "client/ctl/TextTable.h"
#include "common/cores/Inline.h"
#include "common/cores/ProxyGroup.h"

namespace tessera {
namespace {

std::string wordIn(const Object& core, std::string_view field) {
    const FieldEntry& entry = *findField(core.info(), field);
    return wordOfNumber(entry, std::get<std::int64_t>(entry.load(core))).value_or("?");
}

template <typename Core>
nlohmann::ordered_json entryOf(const Object& object, const Core& core) {
    return {{"kind", object.info().name}, {"load", wordIn(object, "load")},   {"distance", core.distance},
            {"wanted", core.wanted},      {"state", wordIn(object, "state")}, {"file", core.file},
            {"problem", core.problem}};
}

}  // namespace

Expected<Answer> run(Application& application, const verb::Inlines&) {
    std::vector<std::pair<ObjectId, nlohmann::ordered_json>> found;
    for (const ObjectType type : {typeOf<Inline>(), typeOf<ProxyGroup>()}) {
        const Expected<SceneExcerpt> told = application.fetchTree({.coreType = type});
        if (!told) return tl::unexpected(told.error());
        for (const TreeNode& node : told->nodes()) {
            const Object core = told->coreOf(node.node);
            if (!core) continue;
            if (const auto* held = core.as<Inline>()) found.emplace_back(node.node, entryOf(core, *held));
            if (const auto* proxy = core.as<ProxyGroup>()) found.emplace_back(node.node, entryOf(core, *proxy));
        }
    }
    nlohmann::ordered_json entries = nlohmann::ordered_json::array();
    if (found.empty())
        return Answer{"no node of the scene holds another file\n", {{"inlines", std::move(entries)}}, {}};
    SceneNames names(application);
    std::vector<ObjectId> nodes;
    for (const auto& [node, entry] : found) nodes.push_back(node);
    names.learn(nodes);
    TextTable table({"node", "kind", "load", "state", "file"});
    for (auto& [node, entry] : found) {
        const std::string problem = entry["problem"], load = entry["load"];
        const std::string when = load == "near" ? fmt::format("near {:g}", entry["distance"].get<double>()) : load;
        table.add({names.node(node), entry["kind"], entry["wanted"].get<bool>() ? when + ", wanted" : when,
                   entry["state"], entry["file"].get<std::string>() + (problem.empty() ? "" : ": " + problem)});
        nlohmann::ordered_json whole = {{"node", names.node(node)}, {"id", node.value}};
        whole.update(entry);
        entries.push_back(std::move(whole));
    }
    return Answer{table.text(), {{"inlines", std::move(entries)}}, {}};
}

}  // namespace tessera
