/// What other files nodes hold.
#pragma once

#include "client/ctl/Answer.h"
#include "client/ctl/CommandLine.h"

namespace tessera {

/// All Inlines and ProxyGroups that stand in the tree: where, when each is loaded, how far it is, its file, why it
/// failed. `set NODE wanted true` loads one, `set NODE wanted false` lets go of it again.
[[nodiscard]] Expected<Answer> run(Application& application, const verb::Inlines&);

}  // namespace tessera
