#include "common/scene/Action.h"

#include <algorithm>
#include <limits>

namespace tessera {

namespace {

Affine3d ownTransform(const Aspect& aspect, const Node& node) {
    const Transform* t = aspect.coreOf<Transform>(node);
    return t ? composeTransform(t->translation, t->rotation, t->scale) : Affine3d::Identity();
}

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

void Action::setHandler(TypeNumber type, Handler handler) {
    const auto number = static_cast<std::size_t>(type);
    TESSERA_CHECK(number < handlers_.size(), "an object type beyond the handler table");
    handlers_[number] = std::move(handler);
}

void Action::run(const Aspect& aspect, ObjectId from) const {
    struct Level {
        const Node* node;
        Affine3d world_T_node;
        std::size_t nextChild;
        std::size_t endChild;
    };
    std::vector<Level> levels;  // no recursion: depth is a matter of memory, not of the stack

    const auto enter = [&](ObjectId id, const Affine3d& world_T_parent) {
        const Node* node = aspect.get<Node>(id);
        if (!node) return;
        Affine3d world_T_node = world_T_parent;
        const Object* core = node->core ? aspect.find(node->core) : nullptr;
        if (core && std::holds_alternative<Transform>(*core))
            world_T_node = world_T_parent * ownTransform(aspect, *node);
        const Visit visit{aspect, id, *node, world_T_node, levels.size()};
        if (nodeHandler_ && nodeHandler_(visit) == Descend::kPast) return;
        if (core) {
            const Handler& handler = handlers_[typeOf(*core).value];
            if (handler && handler(visit) == Descend::kPast) return;
        }
        const ChildRange range = visitHidden_ ? ChildRange{0, node->children.size()} : shownChildren(aspect, *node);
        levels.push_back({node, world_T_node, range.first, range.end});
    };

    const Node* start = aspect.get<Node>(from);
    if (!start) return;
    enter(from, start->parent ? worldTransform(aspect, start->parent) : Affine3d::Identity());
    while (!levels.empty()) {
        Level& level = levels.back();
        if (level.nextChild == level.endChild) {
            levels.pop_back();
            continue;
        }
        const ObjectId child = level.node->children[level.nextChild++];
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
    for (auto it = path.rbegin(); it != path.rend(); ++it)
        if (aspect.coreOf<Transform>(**it)) world_T_node = world_T_node * ownTransform(aspect, **it);
    return world_T_node;
}

}  // namespace tessera
