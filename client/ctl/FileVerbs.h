/// The verb that looks into the server's folders.
#pragma once

#include "client/ctl/Answer.h"
#include "client/ctl/CommandLine.h"

namespace tessera {

[[nodiscard]] Expected<Answer> run(Application& application, const verb::Files& files);

}  // namespace tessera
