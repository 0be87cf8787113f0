#include "common/drawable/SceneBounds.h"

#include <unordered_map>

#include "common/drawable/Drawable.h"
#include "common/drawable/VolumeShapes.h"
#include "common/scene/Action.h"
#include "common/scene/ServerNodes.h"

namespace tessera {

namespace {

Box boundsBelow(const Aspect& scene, ObjectId from, bool ofServers) {
    Box bounds;
    std::unordered_map<MeshKey, Box, MeshKeyHash> local;
    Action action;
    action.onNode([&](const Visit& visit) {
        if (!ofServers && visit.nodeId != from && visit.node.ofServer) return Descend::kPast;
        const Drawable drawable = drawableOf(scene, visit.node);
        if (!drawable) return Descend::kInto;
        const auto [it, isNew] = local.try_emplace(drawable.key());
        if (isNew) it->second = drawable.bounds();
        bounds.extend(it->second.transformed(visit.world_T_node));
        if (const Box seen = boxOnScreens(scene, visit.node.core); !seen.empty())
            bounds.extend(seen.transformed(visit.world_T_node));
        return Descend::kInto;
    });
    action.run(scene, from);
    return bounds;
}

}  // namespace

Box sceneBounds(const Aspect& scene, ObjectId from) {
    const Box bounds = boundsBelow(scene, from, false);
    return bounds.empty() ? boundsBelow(scene, from, true) : bounds;
}

}  // namespace tessera
