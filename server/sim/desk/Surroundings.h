/// What people are told where a file brings surroundings to a scene that has some: of several Environments the first
/// one in document order holds, and the others say nothing (common/cores/Environment.h).
#pragma once

#include <optional>
#include <string>

#include "server/sim/frame/Preparation.h"

namespace tessera {

[[nodiscard]] bool bringsSurroundings(const Preparation& made);

/// Of a file that comes into this scene as it is now, as the last child of `made.node`: whether the file's Environment
/// or the scene's holds. Nothing: only one of them has any. Looks at the scene's nodes where the file has some.
[[nodiscard]] std::optional<std::string> surroundingsNote(const Aspect& scene, const Preparation& made);

}  // namespace tessera
