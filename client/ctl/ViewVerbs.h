/// Where the wall stands in the world, and where heads are: told, or changed.
#pragma once

#include "client/ctl/Answer.h"
#include "client/ctl/CommandLine.h"

namespace tessera {

/// A wish that wants nothing asks where all is.
[[nodiscard]] Expected<Answer> run(Application& application, const verb::View& view);

}  // namespace tessera
