/// The verb that speaks of trackers.
#pragma once

#include "client/ctl/Answer.h"
#include "client/ctl/CommandLine.h"

namespace tessera {

[[nodiscard]] Expected<Answer> run(Application& application, const verb::Trackers&);

}  // namespace tessera
