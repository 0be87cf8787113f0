/// Nodes that whoever serves a scene hangs into it so that something is seen: no file has them, no copy takes them along, and they do
/// not make a scene larger.
#pragma once

#include <string_view>

#include "common/scene/Aspect.h"

namespace tessera {

inline constexpr std::string_view kHandlesName = "handles";                  ///< of manipulators (server/manipulators)
inline constexpr std::string_view kContactsName = "contacts";                ///< of collisions (server/sim/display), below the root
inline constexpr std::string_view kProgramNoticesName = "program-problems";  ///< of programs (server/programs), below the root

/// Whether the node is the top of such nodes. They are known by name, place and core. Costs a comparison for any other node.
[[nodiscard]] inline bool isServersOwn(const Aspect& scene, const Node& node) {
    if (node.name == kHandlesName) {
        const Node* bearer = scene.get<Node>(node.parent);
        return bearer && scene.coreOf<Manipulator>(*bearer) && scene.coreOf<InverseTransform>(node);
    }
    if ((node.name != kContactsName && node.name != kProgramNoticesName) || node.parent != kRootNode) return false;
    const CollisionObject* object = scene.coreOf<CollisionObject>(node);
    return object && object->layers == 0;
}

/// Whether the node is such a top, or stands below one. Costs a look at each node above.
[[nodiscard]] inline bool standsInServersOwn(const Aspect& scene, ObjectId id) {
    for (const Node* node = scene.get<Node>(id); node; node = scene.get<Node>(node->parent))
        if (isServersOwn(scene, *node)) return true;
    return false;
}

}  // namespace tessera
