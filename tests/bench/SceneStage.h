/// One scene as it lives in a running wall: the server's simulation, a host's replica and what the host derives from
/// it.
#pragma once

#include <cstdint>
#include <deque>

#include "client/render/order/RenderAction.h"
#include "common/scene/Aspect.h"
#include "server/sim/frame/Simulation.h"
#include "server/sim/view/ViewSource.h"
#include "tests/bench/SceneMaker.h"

namespace tessera::bench {

class SceneStage {
public:
    SceneStage(SceneShape shape, std::uint64_t size);

    /// A frame of the server with one edit of this kind; seconds of Simulation::step: check, commit, collisions,
    /// inverse, encoding. Ends the program where the edit is refused or stopped.
    double edit(const EditKind& kind, std::size_t turn, bool second);
    /// The oldest frame that the host has not followed yet; seconds of Aspect::apply and RenderScene::update. Ends the
    /// program where its scene is then another.
    double follow();
    /// A frame of the server without any edit: simulation and view.
    double idle();
    [[nodiscard]] const Aspect& scene() const { return simulation_.scene(); }

private:
    Simulation simulation_;
    std::deque<CommittedFrame> frames_;  ///< that the host has not followed
    Aspect replica_;
    RenderScene render_;
    ViewSource view_;
    ScenePlaces places_;
};

}  // namespace tessera::bench
