/// Change lists for common edits, made from the scene as it is. Nothing is changed here: propose the list.
#pragma once

#include <limits>
#include <span>
#include <string_view>

#include "common/base/Error.h"
#include "common/change/ChangeList.h"
#include "common/math/NodeMove.h"
#include "common/scene/Aspect.h"

namespace tessera {

/// The nearest node, from `node` upwards, whose core is a Transform: what moves when somebody moves `node`. kRefused
/// where there is none up to the root.
[[nodiscard]] Expected<ObjectId> movableNode(const Aspect& aspect, ObjectId node);

/// What is said where there is none.
[[nodiscard]] Error cannotBeMoved(std::string_view path);

/// Whether it says anything, in finite numbers, that a Transform can hold. kUsage.
[[nodiscard]] Expected<void> checkMove(const NodeMove& move);

/// Moves a Transform that stands as `present` says.
[[nodiscard]] Expected<ChangeList> moveList(ObjectId core, const Transform& present, const NodeMove& move);

/// Moves `movableNode(node)`. Where nodes share that Transform, all of them move.
[[nodiscard]] Expected<ChangeList> moveList(const Aspect& aspect, ObjectId node, const NodeMove& move);

/// Removes `node` with everything below it, and the cores, materials and images that only they used. kRefused for the
/// root. The server refuses the list while something outside still names a node below (an Interest, say). kLimit: more
/// than `maxNodes` would go.
[[nodiscard]] Expected<ChangeList> removalList(const Aspect& aspect, ObjectId node,
                                               std::size_t maxNodes = std::numeric_limits<std::size_t>::max());
/// The same of several nodes at once, none of them the root or below another one of them.
[[nodiscard]] ChangeList removalOf(const Aspect& aspect, std::span<const ObjectId> nodes);

}  // namespace tessera
