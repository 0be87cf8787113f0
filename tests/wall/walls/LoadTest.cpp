/// A scene that comes in parts while a wall goes on: seen by nobody until it is whole, taken back and brought again as
/// one step, and replayed from a recording.
#include <gtest/gtest.h>

#include <functional>

#include "common/application/Application.h"
#include "server/tools/replay/ReplayCommand.h"
#include "tests/support/wall/AskedWall.h"

namespace tessera::simulation {
namespace {

using namespace std::chrono_literals;

/// 20 thousand nodes in rows of rows of rows, and something that moves in the meantime.
constexpr const char* kForest =
    "node { name: \"forest\" transform {} node { transform {} repeat { count: 10 step { y: 2 } }\n"
    "  node { transform {} repeat { count: 10 step { z: -2 } }\n"
    "    node { transform {} repeat { count: 100 step { x: 2 } }\n"
    "      node { box { size { x: 1 y: 1 z: 1 } } } } } } }\n";

bool waitUntil(Application& application, const std::function<bool()>& reached) {
    for (int look = 0; look < 3000 && !reached(); ++look)
        if (!application.poll(20ms)) return false;
    return reached();
}

TEST(Load, ComesInPartsIsOneStepAndIsReplayed) {
    const test::TestFolder folder;
    const std::string file = folder.write("forest.tsct", kForest), recording = folder.path() + "/load.tsr";
    SimulatedWall wall({.scene = kYard, .draws = false, .record = recording, .server = {"--allow", folder.path()}});
    auto connected = Application::connect({.address = toString(wall.address()), .name = "loader", .timeout = 60s},
                                          wall.platform("loader"));
    ASSERT_TRUE(connected) << connected.error().message << wall.logs();
    Application& application = **connected;
    ASSERT_TRUE(waitUntil(application, [&] { return application.status()->frame.value > 2; })) << wall.logs();
    const std::size_t before = application.scene().objectCount();
    const auto seen = [&] { return findNode(application.scene(), "/forest").has_value(); };

    // What arrives can be counted by whoever follows, and is nowhere in the scene.
    std::size_t hidden = 0;
    ASSERT_TRUE(application.onFrame(
        [&](const notice::Frame&) { hidden += application.scene().objectCount() > before && !seen() ? 1 : 0; }));
    const auto loaded = application.load(file);
    ASSERT_TRUE(loaded) << loaded.error().message << wall.logs();
    EXPECT_GT(loaded->objects, 20'000u);
    ASSERT_TRUE(waitUntil(application, seen));
    EXPECT_GT(hidden, 2u) << "it came in one piece";
    EXPECT_EQ(application.scene().get<Node>(loaded->node)->name, "forest");
    EXPECT_EQ(application.scene().objectCount(), before + loaded->objects);
    EXPECT_EQ(application.status()->undoDepth, 1u);

    ASSERT_TRUE(application.undo());
    ASSERT_TRUE(waitUntil(application, [&] { return !seen() && application.scene().objectCount() == before; }))
        << wall.logs();
    const auto redone = application.redo();
    ASSERT_TRUE(redone) << redone.error().message;
    ASSERT_TRUE(waitUntil(application, seen));
    EXPECT_EQ(application.scene().objectCount(), before + loaded->objects);

    connected->reset();
    const nlohmann::json report = wall.finish();
    ASSERT_FALSE(report.is_null()) << wall.logs();
    EXPECT_EQ(report["faults"].size(), 0u) << report["faults"].dump(2);
    const CommandOutcome replayed = runHere([&] { return runReplay({recording}); });
    EXPECT_EQ(replayed.exitCode, 0) << replayed.output;
}

}  // namespace
}  // namespace tessera::simulation
