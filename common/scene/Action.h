/// A traversal of the tree with a handler per core type: a table, no visitor that names all types.
#pragma once

#include <array>
#include <functional>

#include "common/scene/Aspect.h"

namespace tessera {

/// Where a traversal stands.
struct Visit {
    const Aspect& aspect;
    ObjectId nodeId;
    const Node& node;
    const Affine3d& world_T_node;  ///< this node's own transform included
    std::size_t depth;
};

enum class Descend { kInto, kPast };

/// Depth first, children in order, switches respected, transforms accumulated. Handlers are registered by core type;
/// a node whose core has no handler is just passed through.
class Action {
public:
    using Handler = std::function<Descend(const Visit&)>;

    /// Called when a node with this type of core is entered. One handler per type.
    template <typename Core>
    void on(std::function<Descend(const Visit&, const Core&)> handler) {
        setHandler(Core::kType,
                   [h = std::move(handler)](const Visit& v) { return h(v, *v.aspect.coreOf<Core>(v.node)); });
    }
    /// Called for every node before the handler of its core.
    void onNode(Handler handler) { nodeHandler_ = std::move(handler); }
    /// Whether hidden children of switches are visited too. Default: no.
    void visitHidden(bool yes) { visitHidden_ = yes; }

    void run(const Aspect& aspect, ObjectId from = kRootNode) const;

private:
    void setHandler(TypeNumber type, Handler handler);

    std::array<Handler, 32> handlers_;
    Handler nodeHandler_;
    bool visitHidden_ = false;
};

/// world_T_node by walking up to the root.
[[nodiscard]] Affine3d worldTransform(const Aspect& aspect, ObjectId node);

}  // namespace tessera
