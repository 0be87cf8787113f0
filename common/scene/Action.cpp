#include "common/scene/Action.h"

#include "common/scene/ChildChoice.h"
#include "common/scene/ObjectTable.h"

namespace tessera {

namespace {

void placeCore(const Object& core, const Affine3d& world_T_parent, Affine3d& world_T_node) {
    if (core && core.info().place)
        core.info().place(core.data(), world_T_parent, world_T_node);
    else
        world_T_node = world_T_parent;
}

}  // namespace

Affine3d placeNode(const Aspect& aspect, const Node& node, const Affine3d& world_T_parent) {
    Affine3d world_T_node;
    placeCore(node.core ? aspect.find(node.core) : Object(), world_T_parent, world_T_node);
    return world_T_node;
}

void Action::setHandler(std::size_t type, Handler handler) {
    if (handlers_.size() <= type) handlers_.resize(type + 1);
    handlers_[type] = std::move(handler);
}

void Action::run(const Aspect& aspect, ObjectId from) const {
    // No recursion: depth is a matter of memory, not of the stack. A level stays where it is while those below it come.
    struct Level {
        Affine3d world_T_node;
        ChildList::Iterator nextChild;
        std::size_t left = 0;                          ///< children that have yet to be entered
        std::optional<std::vector<std::size_t>> some;  ///< where those stand among the others; nothing: they are all
        const ChildList* children = nullptr;
        Level* above = nullptr;
        std::unique_ptr<Level> below;
    };
    Level top;
    Level* level = &top;  ///< of the node whose children are entered; `top` stands above all
    std::size_t depth = 0;
    const ObjectTable& table = aspect.table();
    ObjectTable::ConstCursor nodes(table), cores(table);  // one each: neighbours among the one are apart from the other

    const auto enter = [&](ObjectId id, const Affine3d& world_T_parent) {
        const ObjectTable::Slot* slot = nodes.find(id);
        if (!slot || slot->type != kTypeIndex<Node>) return;
        const Node& node = table.node(*slot);
        const ObjectTable::Slot* coreSlot = node.core ? cores.find(node.core) : nullptr;
        const Object core = coreSlot ? table.object(*coreSlot) : Object();
        if (!level->below) {
            level->below = std::make_unique<Level>();
            level->below->above = level;
        }
        Level& here = *level->below;
        placeCore(core, world_T_parent, here.world_T_node);
        const Visit visit{aspect, id, node, core, here.world_T_node, depth};
        if (nodeHandler_ && nodeHandler_(visit) == Descend::kPast) return;
        if (core && core.info().index < handlers_.size()) {
            const Handler& handler = handlers_[core.info().index];
            if (handler && handler(visit) == Descend::kPast) return;
        }
        here.some = visitHidden_ ? std::nullopt : seenChildren(core, node.children.size());
        here.left = here.some ? here.some->size() : node.children.size();
        if (here.left == 0) return;
        here.nextChild = node.children.from(here.some ? here.some->front() : 0);
        here.children = &node.children;
        level = &here;
        ++depth;
    };

    const Node* start = aspect.get<Node>(from);
    if (!start) return;
    enter(from, start->parent ? worldTransform(aspect, start->parent) : Affine3d::Identity());
    while (depth > 0) {
        if (level->left == 0) {
            level = level->above;
            --depth;
            continue;
        }
        const ObjectId child = *level->nextChild;
        --level->left;
        if (!level->some)
            ++level->nextChild;
        else if (level->left > 0)
            level->nextChild = level->children->from((*level->some)[level->some->size() - level->left]);
        enter(child, level->world_T_node);
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

// ---- WorldTransforms -----------------------------------------------------------------------------------------------

struct WorldTransforms::Finder {
    explicit Finder(const ObjectTable& t) : table(t), nodes(t), cores(t) {}
    [[nodiscard]] const Node* node(ObjectId id) {
        const ObjectTable::Slot* slot = id ? nodes.find(id) : nullptr;
        return slot && slot->type == kTypeIndex<Node> ? &table.node(*slot) : nullptr;
    }
    [[nodiscard]] Object core(const Node& node) {
        const ObjectTable::Slot* slot = node.core ? cores.find(node.core) : nullptr;
        return slot ? table.object(*slot) : Object();
    }
    const ObjectTable& table;
    ObjectTable::ConstCursor nodes, cores;
};

WorldTransforms::WorldTransforms(const Aspect& aspect) : find_(std::make_unique<Finder>(aspect.table())), known_(64) {}
WorldTransforms::~WorldTransforms() = default;

Affine3d WorldTransforms::of(ObjectId id) {
    const auto knownAt = [this](ObjectId node) -> Known& {
        return known_[static_cast<std::size_t>((node.value * 0x9E3779B97F4A7C15ull) >> 58)];
    };
    path_.clear();
    ids_.clear();
    Affine3d world_T_node = Affine3d::Identity();
    for (const Node* node = find_->node(id); node; node = find_->node(id)) {
        if (!path_.empty() && knownAt(id).node == id) {
            world_T_node = knownAt(id).world_T_node;
            break;
        }
        path_.push_back(node);
        ids_.push_back(id);
        id = node->parent;
    }
    for (std::size_t i = path_.size(); i-- > 0;) {
        const Affine3d world_T_parent = world_T_node;
        placeCore(find_->core(*path_[i]), world_T_parent, world_T_node);
        if (i > 0) knownAt(ids_[i]) = {ids_[i], world_T_node};
    }
    return world_T_node;
}

}  // namespace tessera
