/// A panel as whoever holds its token is told of it.
#pragma once

#include "common/request/PanelRequests.h"
#include "common/scene/Aspect.h"
#include "server/panel/Panel.h"

namespace tessera {

/// `stamp` is the caller's to set.
[[nodiscard]] answer::PanelState stateOf(const Panel& panel, const Aspect& scene);

}  // namespace tessera
