/// A traversal of the tree with a handler per core type: a table, no visitor that names all types.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "common/scene/Aspect.h"

namespace tessera {

/// Where a traversal stands.
struct Visit {
    const Aspect& aspect;
    ObjectId nodeId;
    const Node& node;
    Object core;                   ///< the node's; nothing where it has none
    const Affine3d& world_T_node;  ///< this node's own transform included
    std::size_t depth;
};

enum class Descend { kInto, kPast };

/// Depth first, children in order, what hides children respected (ChildChoice.h), transforms accumulated. Handlers are
/// registered by core type; a node whose core has no handler is just passed through.
class Action {
public:
    using Handler = std::function<Descend(const Visit&)>;

    /// Called when a node with this type of core is entered. One handler per type.
    template <typename Core>
    void on(std::function<Descend(const Visit&, const Core&)> handler) {
        setHandler(kTypeIndex<Core>, [h = std::move(handler)](const Visit& v) { return h(v, *v.core.as<Core>()); });
    }
    /// Called for every node before the handler of its core.
    void onNode(Handler handler) { nodeHandler_ = std::move(handler); }
    /// Whether hidden children of switches are visited too. Default: no.
    void visitHidden(bool yes) { visitHidden_ = yes; }

    void run(const Aspect& aspect, ObjectId from = kRootNode) const;

private:
    void setHandler(std::size_t type, Handler handler);

    std::vector<Handler> handlers_;  ///< by the index of the type; as many as were asked for
    Handler nodeHandler_;
    bool visitHidden_ = false;
};

/// world_T_node of a node whose parent stands at `world_T_parent`. The one product that everybody makes, the same bits.
[[nodiscard]] Affine3d placeNode(const Aspect& aspect, const Node& node, const Affine3d& world_T_parent);

/// world_T_node by walking up to the root.
[[nodiscard]] Affine3d worldTransform(const Aspect& aspect, ObjectId node);

/// The same of many nodes of one state of the scene, one after the other: what lies above those near each other is
/// multiplied once. The same bits. Holds until the aspect's next apply.
class WorldTransforms {
public:
    explicit WorldTransforms(const Aspect& aspect);
    ~WorldTransforms();
    /// Identity where there is no such node.
    [[nodiscard]] Affine3d of(ObjectId node);

private:
    struct Known {
        ObjectId node;
        Affine3d world_T_node;
    };
    struct Finder;
    std::unique_ptr<Finder> find_;
    std::vector<Known> known_;  ///< inner nodes, each at the place that its id leads to; the last one asked for stays
    std::vector<const Node*> path_;
    std::vector<ObjectId> ids_;
};

}  // namespace tessera
