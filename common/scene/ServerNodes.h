/// Nodes that whoever serves a scene hangs into it so that something is seen: no file has them, no copy takes them
/// along, and they do not make a scene larger. The tops of such nodes say so themselves (Node::ofServer), whatever
/// others call theirs.
#pragma once

#include <string_view>

#include "common/scene/Aspect.h"

namespace tessera {

inline constexpr std::string_view kHandlesName = "handles";    ///< of manipulators (server/manipulators)
inline constexpr std::string_view kContactsName = "contacts";  ///< of collisions (server/sim/display), below the root
inline constexpr std::string_view kProgramNoticesName =
    "program-problems";  ///< of programs (server/programs), below the root

/// Whether the node is such a top, or stands below one. Costs a look at each node above.
[[nodiscard]] inline bool standsInServersOwn(const Aspect& scene, ObjectId id) {
    for (const Node* node = scene.get<Node>(id); node; node = scene.get<Node>(node->parent))
        if (node->ofServer) return true;
    return false;
}

}  // namespace tessera
