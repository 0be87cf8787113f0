#include "client/ctl/SceneNames.h"

#include <algorithm>

namespace tessera {

using Json = nlohmann::ordered_json;

namespace {
/// What is learned level by level may come from different states of the scene: it need not end at the root.
constexpr std::size_t kMaxDepth = SceneLimits().maxDepth;
/// Looked for in one walk through the tree.
constexpr std::size_t kCoresAtOnce = 4096;
}  // namespace

void SceneNames::learn(std::span<const ObjectId> objects) {
    std::vector<ObjectId> unknown;
    std::vector<std::string> names;
    for (const ObjectId id : objects) {
        if (!id || !fresh_.insert(id).second) continue;
        unknown.push_back(id);
        names.push_back(numberOf(id));
    }
    const Expected<std::vector<ObjectInfo>> told = application_.describe(names);
    if (!told) return;
    for (std::size_t i = 0; i < unknown.size(); ++i) known_[unknown[i]] = (*told)[i];
}

void SceneNames::learnWithAncestors(std::span<const ObjectId> nodes) {
    std::vector<ObjectId> level(nodes.begin(), nodes.end());
    for (std::size_t depth = 0; depth < kMaxDepth && !level.empty(); ++depth) {
        learn(level);
        std::set<ObjectId> above;
        for (const ObjectId id : level) {
            const auto known = known_.find(id);
            if (known == known_.end()) return;  // the server does not answer
            if (known->second.parent && !known_.contains(known->second.parent)) above.insert(known->second.parent);
        }
        level.assign(above.begin(), above.end());
    }
}

void SceneNames::learnInterests(std::span<const ObjectId> cores) {
    const auto isKnown = [&](ObjectId core) { return !core || holders_.contains(core); };
    if (!std::ranges::all_of(cores, isKnown)) {
        const Expected<std::map<ObjectId, ObjectId>> told = interestsOf(application_);
        if (told) holders_ = *told;
        for (const ObjectId core : cores)
            if (core) holders_.try_emplace(core);
    }
    std::vector<ObjectId> named;
    for (const ObjectId core : cores)
        if (core && holders_.at(core)) named.push_back(holders_.at(core));
    learn(named);
}

std::string SceneNames::node(ObjectId id) const {
    const auto known = known_.find(id);
    return known == known_.end() || !known->second.id ? numberOf(id) : known->second.path;
}

Json SceneNames::pairJson(ObjectId a, ObjectId b) const {
    return Json::array({node(a), node(b)});
}

std::string SceneNames::interest(ObjectId core) const {
    if (!core) return "-";
    const auto holder = holders_.find(core);
    return node(holder == holders_.end() || !holder->second ? core : holder->second);
}

Json SceneNames::interestJson(ObjectId core) const {
    return core ? Json(interest(core)) : Json(nullptr);
}

bool SceneNames::hangsOn(ObjectId node, std::span<const ObjectId> cores) const {
    auto at = known_.find(node);
    for (std::size_t depth = 0; depth < kMaxDepth && at != known_.end(); ++depth) {
        if (at->second.core && std::ranges::find(cores, at->second.core) != cores.end()) return true;
        at = known_.find(at->second.parent);
    }
    return false;
}

Expected<std::vector<ObjectId>> nodesHolding(Application& application, std::span<const ObjectId> cores) {
    std::vector<ObjectId> nodes;
    for (std::size_t done = 0; done < cores.size(); done += kCoresAtOnce) {
        const auto some = cores.subspan(done, std::min(cores.size() - done, kCoresAtOnce));
        const Expected<SceneExcerpt> told = application.fetchTree({.cores = {some.begin(), some.end()}});
        if (!told) return tl::unexpected(told.error());
        for (const TreeNode& node : told->nodes()) nodes.push_back(node.node);
    }
    std::ranges::sort(nodes);
    return nodes;
}

Expected<std::map<ObjectId, ObjectId>> interestsOf(Application& application) {
    const Expected<SceneExcerpt> told = application.fetchTree({.coreType = typeOf<Interest>()});
    if (!told) return tl::unexpected(told.error());
    std::map<ObjectId, ObjectId> holders;
    for (const TreeNode& node : told->nodes()) {
        const Node* here = told->get<Node>(node.node);
        if (!here->core) continue;
        ObjectId& holder = holders.try_emplace(here->core, node.node).first->second;
        holder = std::min(holder, node.node);
    }
    return holders;
}

}  // namespace tessera
