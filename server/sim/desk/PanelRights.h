/// What somebody may say whose token is of a panel.
#pragma once

#include <optional>

#include "common/request/Requests.h"
#include "common/scene/Aspect.h"
#include "server/panel/Panel.h"

namespace tessera {

/// None: it is what one of its controls does, or asks what their nodes hold. Of requests that say `forPanels`.
[[nodiscard]] std::optional<Error> whyNotOfPanel(const Panel& panel, const Aspect& scene,
                                                 const ApplicationRequest& request);

}  // namespace tessera
