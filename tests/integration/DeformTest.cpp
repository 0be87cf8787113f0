/// tessera-deform beside a running wall: control points are led, and at the end they are where they were.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/integration/LiveWall.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

TEST(DeformProgram, LeadsControlPointsAndBringsThemBack) {
    LiveWall wall({.wall = "1x1", .scene = std::string(TESSERA_SOURCE_DIR) + "/tests/data/scenes/distance.tsct"});
    ASSERT_FALSE(wall.address().empty()) << wall.server().output();
    wall.startClient("all");
    ASSERT_TRUE(wall.waitForFrame("front-0-0", 2, 60s)) << wall.logs();
    // How far the ball is from the cube, whose top is led.
    const auto distance = [&] {
        EXPECT_TRUE(wall.waitForFrame("front-0-0", wall.shownFrame("front-0-0") + 3, 60s)) << wall.logs();
        const json told = json::parse(wall.ctl({"--json", "contacts", "--distances"}).output, nullptr, false);
        return told.is_object() && told["distances"].size() == 1 ? told["distances"][0]["distance"].get<double>()
                                                                 : std::nan("");
    };
    const auto deform = [&](std::vector<std::string> words) {
        words.insert(words.begin(), {program("tessera-deform"), "--server", wall.address()});
        return run(wall.folder(), words, 120s);
    };
    EXPECT_NEAR(distance(), 1, 1e-3);
    {
        // As long as it runs. The cube's top sways, its foot stays.
        Process led(wall.folder(), "deform",
                    {program("tessera-deform"), "--server", wall.address(), "bend-y:0..40:1:/cube"});
        bool sways = false;
        for (int look = 0; look < 100 && !sways; ++look) sways = std::abs(distance() - 1) > 0.05;
        EXPECT_TRUE(sways) << led.output();
    }
    EXPECT_EQ(wall.ctl({"undo"}).exitCode, 0);
    EXPECT_NEAR(distance(), 1, 1e-3) << "one step of undo takes all of it back";

    const Outcome done = deform({"--seconds", "0.5", "twist-y:40:1:/cube", "bend-x:20:1:/cube"});
    EXPECT_EQ(done.exitCode, 0) << done.output;
    EXPECT_NEAR(distance(), 1, 1e-3) << "brought back";

    EXPECT_EQ(deform({"bend:20:1:/ball"}).exitCode, 3) << "a ball has no control points";
    EXPECT_EQ(deform({"fold:20:1:/cube"}).exitCode, 2);
    EXPECT_EQ(deform({"bend:20:1:/nobody"}).exitCode, 3);
    (void)wall.finish();
}

}  // namespace
}  // namespace tessera::test
