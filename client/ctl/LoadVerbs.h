/// The verbs about files on their way into the scene.
#pragma once

#include "client/ctl/Answer.h"
#include "client/ctl/CommandLine.h"

namespace tessera {

/// On a terminal it says how far the server is, in one line; Ctrl-C cancels the load, a second one leaves at once.
[[nodiscard]] Expected<Answer> run(Application& application, const verb::Load& load);
[[nodiscard]] Expected<Answer> run(Application& application, const verb::Loads&);
[[nodiscard]] Expected<Answer> run(Application& application, const verb::Cancel& cancel);

}  // namespace tessera
