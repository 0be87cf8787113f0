/// What a desk needs around it, where nothing is read from files and nobody draws.
#pragma once

#include <gtest/gtest.h>

#include "server/sim/desk/RequestDesk.h"
#include "server/sim/frame/Simulation.h"
#include "tests/unit/session/ServerFixture.h"
#include "tests/unit/sim/SceneForTests.h"

namespace tessera::test {

class DeskStage : public testing::Test {
protected:
    [[nodiscard]] DeskSurroundings surroundings() {
        return {.wall = wall,
                .blobs = blobs,
                .session = server.session,
                .simulation = simulation,
                .view = view,
                .loader = loader,
                .drags = drags};
    }

    Wall wall = wallOfOne();
    BlobStore blobs;
    ServerFixture server;
    Simulation simulation;
    ViewSource view{wall, ""};
    Loader loader{{}, std::make_shared<SceneFiles>(ImportOptions(), std::vector<std::string>()), [](Preparation) {}};
    ManipulatorDrags drags;
};

}  // namespace tessera::test
