/// A person flies: what windows and applications say moves the view of a wall, and nothing that goes wrong on the way
/// leaves it flying.
#include <gtest/gtest.h>

#include "common/application/Application.h"
#include "server/tools/replay/ReplayCommand.h"
#include "tests/support/wall/AskedWall.h"
#include "tests/support/words/Words.h"

namespace tessera::simulation {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;

class FlownWall : public AskedWall {
public:
    explicit FlownWall(AskedWallOptions options = {}) : AskedWall(oneTile(std::move(options))) {}
    /// The thing in the middle of the picture: another thing, or another point of it, where the view has moved.
    [[nodiscard]] json middle() { return ask({"pick", "80", "60"}); }
    [[nodiscard]] json steering() { return ask({"status"})["steering"]; }
    [[nodiscard]] std::unique_ptr<Application> pilot() {
        auto made = Application::connect({.address = toString(address()), .name = "pilot", .followScene = false},
                                         platform("pilot"));
        EXPECT_TRUE(made) << made.error().message;
        return made ? std::move(*made) : nullptr;
    }
    /// The view is the same after half a second.
    [[nodiscard]] bool rests() {
        for (int look = 0; look < 40; ++look) {
            const json before = middle();
            world().runFor(500ms);
            if (middle() == before) return true;
        }
        return false;
    }

private:
    static AskedWallOptions oneTile(AskedWallOptions options) {
        options.wall = "1x1";
        options.widthPx = 160;
        options.heightPx = 90;
        if (options.scene == AskedWallOptions().scene) options.scene = kYard;
        return options;
    }
};

TEST(FlightWall, AKeyMovesTheViewAndHomeLeadsBack) {
    FlownWall wall;
    // The carriage drives for a second; then only the view moves what is in the middle of the picture.
    ASSERT_TRUE(wall.waitForFrame(90)) << wall.logs();
    EXPECT_EQ(wall.ask({"status"})["navigation"], "fly");
    const json begun = wall.middle();
    ASSERT_EQ(begun["hit"], true);
    InputState keys{.right = InputState::kFull};
    wall.host("all").input(keys);
    wall.world().runFor(500ms);
    EXPECT_EQ(wall.steering(), json{"all"});
    EXPECT_NE(wall.middle(), begun);
    keys.right = 0;
    wall.host("all").input(keys);
    EXPECT_TRUE(wall.rests()) << "a key that was let go";
    EXPECT_NE(wall.middle(), begun);
    keys.ask(InputAction::kHome);
    wall.host("all").input(keys);
    EXPECT_TRUE(wall.rests());
    EXPECT_EQ(wall.middle(), begun) << "to the very bits";
    EXPECT_EQ(wall.finish()["faults"].size(), 0u);
}

TEST(FlightWall, AHostThatIsKilledHoldsNothing) {
    FlownWall wall;
    ASSERT_TRUE(wall.waitForFrame(90)) << wall.logs();
    wall.host("all").input({.right = InputState::kFull});
    wall.world().runFor(200ms);
    ASSERT_EQ(wall.steering(), json{"all"});
    wall.killHost("all");
    EXPECT_TRUE(wall.world().runUntil([&] { return wall.steering().empty(); }, 20s));
    EXPECT_TRUE(wall.rests());
}

TEST(FlightWall, OneForThePublicTakesNoInput) {
    FlownWall wall({.server = {"--no-input"}});
    EXPECT_EQ(wall.ask({"status"})["navigation"], "");
    const CommandOutcome refused = wall.ctl({"navigate", "home"});
    EXPECT_EQ(refused.exitCode, 1);
    EXPECT_WORDS(refused.output);
    EXPECT_NE(wall.ctl({"fly"}).exitCode, 0);
    (void)wall.finish();
}

/// Its bounds are looked for beside the frames, in the scene of the frame in which the key went down.
TEST(FlightWall, TheKeyFShowsAllOfASceneThatMoves) {
    FlownWall wall({.scene = std::string(TESSERA_SOURCE_DIR) + "/deploy/scenes/moving.tsct"});
    const std::unique_ptr<Application> pilot = wall.pilot();
    ASSERT_TRUE(pilot);
    InputState keys;
    for (const InputAction key : {InputAction::kFitAll, InputAction::kFit, InputAction::kHome, InputAction::kFitAll}) {
        keys.ask(key);
        ASSERT_TRUE(pilot->navigate({.input = keys})) << wall.logs();
        ASSERT_TRUE(wall.waitForFrame(wall.shownFrame().value_or(0) + 5)) << wall.logs();
    }
    EXPECT_EQ(wall.finish()["faults"].size(), 0u);
}

/// A recording holds the scene that is flown through, and not the view: the same again, to the hash, with a
/// walker who asks the scene in every frame.
TEST(FlightWall, ARecordingOfAFlightIsMadeAgain) {
    const test::TestFolder folder;
    const std::string recording = folder.path() + "/flight.tsr";
    FlownWall wall({.record = recording});
    const json begun = wall.middle();
    {
        const std::unique_ptr<Application> pilot = wall.pilot();
        ASSERT_TRUE(pilot);
        const InputState held{.right = InputState::kFull, .back = -InputState::kFull};
        for (const NavigationMode mode : {NavigationMode::kFly, NavigationMode::kWalk, NavigationMode::kOrbit}) {
            ASSERT_TRUE(pilot->navigate({.mode = mode, .input = held}));
            wall.world().runFor(700ms);
        }
        EXPECT_TRUE(pilot->navigate({.deed = NavigationWish::Deed::kKeepBookmark, .bookmark = 1}));
        EXPECT_EQ(wall.steering().size(), 1u);
        EXPECT_NE(wall.middle(), begun);
    }
    EXPECT_TRUE(wall.world().runUntil([&] { return wall.steering().empty(); }, 10s)) << "who has left holds nothing";
    wall.tell({"move", "/post", "0.5", "0", "0", "--by"});
    EXPECT_EQ(wall.ctl({"bookmark", "1"}).exitCode, 0);
    EXPECT_EQ(wall.ctl({"bookmark", "2"}).exitCode, 3) << "nobody has kept it";
    EXPECT_EQ(wall.ctl({"navigate", "sideways"}).exitCode, 2);
    EXPECT_EQ(wall.finish()["faults"].size(), 0u);
    const CommandOutcome again = runHere([&] { return runReplay({recording}); });
    EXPECT_EQ(again.exitCode, 0) << again.output;
}

}  // namespace
}  // namespace tessera::simulation
