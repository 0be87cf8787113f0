/// Which wall keys are for.
#pragma once

#include <string>

#include "common/base/Error.h"

namespace tessera {

/// The name that a wall gives itself. `wall`: its file, or a shipped one's name, as tessera-server takes it.
[[nodiscard]] Expected<std::string> nameOfWall(const std::string& wall);

}  // namespace tessera
