/// What somebody may say whose token is of a panel.
#pragma once

#include <map>
#include <memory>
#include <optional>

#include "common/request/Requests.h"
#include "common/scene/Aspect.h"
#include "server/panel/Panel.h"
#include "server/panel/PanelInScene.h"

namespace tessera {

/// Nodes of a panel are looked for once until the scene changes, however much its people say: that takes up to a
/// millisecond of the frame thread.
class PanelRights {
public:
    /// None: it is what one of the panel's controls does, or asks what their nodes hold. Of requests that say
    /// `forPanels`. `at`: the scene's.
    [[nodiscard]] std::optional<Error> whyNot(const std::shared_ptr<const Panel>& panel, const Aspect& scene,
                                              Sequence at, const ApplicationRequest& request);

private:
    struct Standing {
        std::shared_ptr<const Panel> panel;
        Sequence at;
        PanelInScene there;
    };
    const PanelInScene& in(const std::shared_ptr<const Panel>& panel, const Aspect& scene, Sequence at);

    std::map<const Panel*, Standing> found_;
};

}  // namespace tessera
