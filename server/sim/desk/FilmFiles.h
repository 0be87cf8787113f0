/// Which files films may come from.
#pragma once

#include <memory>

#include "server/movies/Movies.h"
#include "server/sim/desk/SceneFiles.h"

namespace tessera {

/// As what Inlines hold. Ordinary files alone.
[[nodiscard]] Movies::Opener filmOpener(std::shared_ptr<SceneFiles> files);

}  // namespace tessera
