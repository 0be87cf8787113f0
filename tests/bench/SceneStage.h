/// One scene as it lives in a running wall: the server's simulation, a host's replica and what the host derives from
/// it.
#pragma once

#include <memory>
#include <string>

#include "client/render/RenderAction.h"
#include "common/scene/Aspect.h"
#include "server/sim/Simulation.h"
#include "server/sim/ViewSource.h"
#include "tests/bench/SceneMaker.h"

namespace tessera::bench {

/// Seconds of processor time.
struct EditTimes {
    double server = 0;  ///< Simulation::step: check, commit, collisions, inverse, encoding
    double client = 0;  ///< Aspect::apply and RenderScene::update
};

class SceneStage {
public:
    SceneStage(SceneShape shape, std::uint64_t size);

    /// One frame with one edit of this kind. Ends the program where it is refused, stopped, or not the same on the
    /// host.
    EditTimes edit(const EditKind& kind, std::size_t turn, bool second);
    /// A frame of the server without any edit: simulation and view.
    double idle();
    [[nodiscard]] const Aspect& scene() const { return simulation_.scene(); }

private:
    Simulation simulation_;
    Aspect replica_;
    RenderScene render_;
    ViewSource view_;
    ScenePlaces places_;
};

}  // namespace tessera::bench
