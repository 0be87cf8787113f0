/// Which files films may come from.
#pragma once

#include <string>
#include <vector>

#include "server/movies/Movies.h"

namespace tessera {

/// As what Inlines hold: whole paths below `allowed` (--allow) or beside the scenes, and assets. Ordinary files alone.
[[nodiscard]] Movies::Opener filmOpener(std::vector<std::string> allowed, std::vector<std::string> assets, std::vector<std::string> scenes);

}  // namespace tessera
