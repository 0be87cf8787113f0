/// Which children of a node are seen: what a Switch chooses for all, and a DistanceLOD for each user.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/scene/Aspect.h"

namespace tessera {

/// Which of `count` children a core lets be seen, wherever users are: a Switch's, the first of a DistanceLOD.
/// Ascending. Nothing: all are.
[[nodiscard]] std::optional<std::vector<std::size_t>> seenChildren(const Object& core, std::size_t count);

/// Users that `Node::levels` tells apart: with the one at i of a wall's users go those at i + 8, i + 16 … The bytes of
/// users that a wall does not have are those of users that it has: where all see the same child all bytes are the same.
inline constexpr std::size_t kLevelUsers = 8;

/// The child that a DistanceLOD at `node` shows to a user; past the end where there is no child. What `levels` names
/// beyond the children is the last of them.
[[nodiscard]] inline std::size_t levelOf(const Node& node, std::size_t user) {
    const std::size_t level = static_cast<std::uint64_t>(node.levels) >> (8 * (user % kLevelUsers)) & 0xff;
    return node.children.empty() ? 0 : std::min(level, node.children.size() - 1);
}

/// Says what is wrong with the ranges of a DistanceLOD: a number that is not finite or below 0, ranges that do not
/// ascend (of sizes: descend), more of them than levels can be told apart. Fewer or more children than ranges want are
/// no error: levels beyond the children show the last of them, children beyond the levels are not seen.
[[nodiscard]] Expected<void> checkRanges(const DistanceLOD& lod);

}  // namespace tessera
