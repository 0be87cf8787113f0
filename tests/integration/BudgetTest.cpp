/// A budget of milliseconds on walls of real processes: detail goes while they are late, on all tiles alike, and comes
/// back.
#include <gtest/gtest.h>

#include "tests/integration/AskedWall.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;

const std::string kRestless = std::string(TESSERA_SOURCE_DIR) + "/deploy/scenes/moving.tsct";

/// Asks until the wall is at the step, or a minute has gone.
bool reaches(AskedWall& wall, unsigned step) {
    for (const auto until = std::chrono::steady_clock::now() + 60s; std::chrono::steady_clock::now() < until;
         std::this_thread::sleep_for(20ms))
        if (wall.ask({"budget"})["detail"] == step) return true;
    return false;
}

TEST(Budget, DetailGoesInMotionAndComesBackAtRest) {
    Picture whole;
    {
        AskedWall wall({.wall = "1x1", .scene = kRestless});
        ASSERT_TRUE(wall.start()) << wall.logs();
        for (const char* node : {"/crawl", "/change", "/glow", "/swing"}) {
            wall.tell({"pause", node});
            wall.tell({"seek", node, "0.5"});
        }
        whole = wall.picture("whole");
        EXPECT_FALSE(wall.finish().is_null()) << wall.logs();
    }
    AskedWall wall({.wall = "2x2", .scene = kRestless});
    ASSERT_TRUE(wall.start()) << wall.logs();
    EXPECT_EQ(wall.ask({"budget"})["budget_ms"], 0);
    wall.tell({"budget", "0.1"});  // which no frame of it is drawn in
    EXPECT_TRUE(reaches(wall, 6)) << wall.ask({"status"}).dump(2);
    for (const char* node : {"/crawl", "/change", "/glow", "/swing"}) {
        wall.tell({"pause", node});
        wall.tell({"seek", node, "0.5"});
    }
    // At rest all of it is drawn, whatever the budget; the bytes are those of a wall without one.
    EXPECT_TRUE(reaches(wall, 0)) << wall.ask({"status"}).dump(2);
    wall.settle();
    EXPECT_EQ(pixelsThatDiffer(wall.picture("rest"), whole), 0u);
    wall.tell({"budget", "off"});
    const nlohmann::json report = wall.finish();
    ASSERT_FALSE(report.is_null()) << wall.logs();
    EXPECT_GT(report["detail"]["frames_at"][6], 0) << report["detail"].dump();
    EXPECT_GT(report["detail"]["changes"], 6);
    EXPECT_GT(report["detail"]["late"], 0);
    EXPECT_TRUE(report["faults"].empty()) << report["faults"].dump(2);
}

TEST(Budget, WhatIsNoneIsRefusedInWords) {
    AskedWall wall({.wall = "1x1", .scene = kRestless});
    ASSERT_TRUE(wall.start()) << wall.logs();
    for (const char* wrong : {"-1", "nan", "0.01", "60001", "many", "1e999"}) {
        const Outcome outcome = wall.wall().ctl({"budget", wrong});
        EXPECT_NE(outcome.exitCode, 0) << wrong;
        EXPECT_NE(outcome.output.find("budget"), std::string::npos) << outcome.output;
    }
    EXPECT_FALSE(wall.finish().is_null()) << wall.logs();
}

}  // namespace
}  // namespace tessera::test
