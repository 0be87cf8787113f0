/// Which materials the scene has, what they look like, who uses them.
#pragma once

#include "client/ctl/Answer.h"
#include "client/ctl/CommandLine.h"
#include "common/cores/Material.h"

namespace tessera {

/// Needs an application that follows the scene.
[[nodiscard]] Expected<Answer> run(Application& application, const verb::Materials& materials);

/// "dark red, rough metal, see-through".
[[nodiscard]] std::string lookOf(const Material& material);

}  // namespace tessera
