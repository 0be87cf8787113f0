/// What is odd about a wall and may be meant so.
#pragma once

#include <string>
#include <vector>

#include "common/wall/Wall.h"

namespace tessera {

/// A sentence each: pixels that are not square.
[[nodiscard]] std::vector<std::string> wallNotes(const Wall& wall);

}  // namespace tessera
