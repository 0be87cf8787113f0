#include "common/scene/Action.h"

#include <algorithm>
#include <limits>

namespace tessera {

namespace {

/// Children [first, end) of a node that a traversal enters.
struct ChildRange {
    std::size_t first = 0;
    std::size_t end = 0;
};

ChildRange shownChildren(const Aspect& aspect, const Node& node) {
    const Switch* choice = aspect.coreOf<Switch>(node);
    if (!choice || choice->choice == Switch::kAll) return {0, node.children.size()};
    if (choice->choice < 0 || static_cast<std::uint64_t>(choice->choice) >= node.children.size()) return {};
    const auto index = static_cast<std::size_t>(choice->choice);
    return {index, index + 1};
}

}  // namespace

Affine3d placeNode(const Aspect& aspect, const Node& node, const Affine3d& world_T_parent) {
    const Object core = node.core ? aspect.find(node.core) : Object();
    return core && core.info().pose ? core.info().pose(core.data()).below(world_T_parent) : world_T_parent;
}

void Action::setHandler(std::size_t type, Handler handler) {
    if (handlers_.size() <= type) handlers_.resize(type + 1);
    handlers_[type] = std::move(handler);
}

void Action::run(const Aspect& aspect, ObjectId from) const {
    struct Level {
        Affine3d world_T_node;
        ChildList::Iterator nextChild;
        std::size_t left;
    };
    std::vector<Level> levels;  // no recursion: depth is a matter of memory, not of the stack

    const auto enter = [&](ObjectId id, const Affine3d& world_T_parent) {
        const Node* node = aspect.get<Node>(id);
        if (!node) return;
        const Object core = node->core ? aspect.find(node->core) : Object();
        const Affine3d world_T_node =
            core && core.info().pose ? core.info().pose(core.data()).below(world_T_parent) : world_T_parent;
        const Visit visit{aspect, id, *node, world_T_node, levels.size()};
        if (nodeHandler_ && nodeHandler_(visit) == Descend::kPast) return;
        if (core && core.info().index < handlers_.size()) {
            const Handler& handler = handlers_[core.info().index];
            if (handler && handler(visit) == Descend::kPast) return;
        }
        const ChildRange range = visitHidden_ ? ChildRange{0, node->children.size()} : shownChildren(aspect, *node);
        levels.push_back({world_T_node, node->children.from(range.first), range.end - range.first});
    };

    const Node* start = aspect.get<Node>(from);
    if (!start) return;
    enter(from, start->parent ? worldTransform(aspect, start->parent) : Affine3d::Identity());
    while (!levels.empty()) {
        Level& level = levels.back();
        if (level.left == 0) {
            levels.pop_back();
            continue;
        }
        const ObjectId child = *level.nextChild;
        ++level.nextChild;
        --level.left;
        const Affine3d world_T_parent = level.world_T_node;  // `enter` grows the stack
        enter(child, world_T_parent);
    }
}

Affine3d worldTransform(const Aspect& aspect, ObjectId node) {
    std::vector<const Node*> path;
    for (const Node* n = aspect.get<Node>(node); n; n = n->parent ? aspect.get<Node>(n->parent) : nullptr)
        path.push_back(n);
    // From the top down, as a traversal multiplies: the same bits.
    Affine3d world_T_node = Affine3d::Identity();
    for (auto it = path.rbegin(); it != path.rend(); ++it) world_T_node = placeNode(aspect, **it, world_T_node);
    return world_T_node;
}

}  // namespace tessera
