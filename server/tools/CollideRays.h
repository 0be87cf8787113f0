/// tessera-collide FILE --query ray: what rays meet in a scene or model.
#pragma once

#include "common/base/Error.h"
#include "server/tools/CollideCommand.h"

namespace tessera {

/// Answers each ray of the file arguments.poses, on a line of stdout, with what it meets first: the node, t in lengths
/// of its direction, the face of what is drawn there, point and normal in the world.
[[nodiscard]] Expected<void> collideRays(const CollideArguments& arguments);

}  // namespace tessera
