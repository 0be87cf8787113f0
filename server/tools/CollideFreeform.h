/// tessera-collide on smooth surfaces: subdivision surfaces and NURBS of files, against each other, triangles and hulls.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "server/collision/freeform/FreeformQuery.h"
#include "server/collision/pairwise/CollisionShape.h"
#include "server/tools/CollideCommand.h"

namespace tessera {

/// A file as its kind. kBadInput, kNotFound, kLimit name the file.
[[nodiscard]] Expected<FreeformShape> loadFreeform(const std::string& path, const std::optional<FreeformKind>& kind, Representation otherwise, const CollideArguments& arguments);

/// The same with triangles of it, for who asks for its depth: as the table of pairs takes it.
[[nodiscard]] Expected<std::shared_ptr<CollisionShape>> loadFreeformShape(const std::string& path, const std::optional<FreeformKind>& kind, Representation otherwise,
                                                                          const CollideArguments& arguments);

/// The answer to one line of the pose file, without its end; `us`: what it took.
[[nodiscard]] std::string freeformAnswer(FreeformPair& pair, const PoseLine& pose, const CollideArguments& arguments, double& us);

}  // namespace tessera
