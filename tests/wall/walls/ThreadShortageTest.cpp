/// A machine that starts no thread for a while: what needs one is refused in words or waits, and the wall goes on.
#include <gtest/gtest.h>

#include "tests/support/wall/AskedWall.h"
#include "tests/support/wall/ThreadShortage.h"

namespace tessera::simulation {
namespace {

const std::string kRooms = std::string(TESSERA_SOURCE_DIR) + "/deploy/scenes/gallery";

class ThreadShortages : public testing::Test {
    void SetUp() override {
        if (!ThreadShortage::kRefuses) GTEST_SKIP() << "a sanitizer stands where threads are refused";
    }
};

TEST_F(ThreadShortages, ALoadIsRefusedAndLaterDone) {
    AskedWall wall({.wall = "1x1", .scene = kYard, .server = {"--allow", kRooms}});
    const std::vector<std::string> load = {"load", kRooms + "/rooms/lantern.tsct"};
    {
        const ThreadShortage shortage;
        EXPECT_NE(wall.refused(load).find("no room for another thread"), std::string::npos);
        wall.settle();
    }
    EXPECT_EQ(wall.ctl(load).exitCode, 0);
}

TEST_F(ThreadShortages, AFilmWaitsAndPlaysLater) {
    AskedWall wall({.wall = "1x1", .scene = kRooms + "/1b-movie.tsct"});
    const auto film = [&]() -> nlohmann::json {
        const nlohmann::json told = wall.ask({"animations"});
        for (const nlohmann::json& entry : told["animations"])
            if (entry["kind"] == "Movie") return entry;
        return {};
    };
    wall.tell({"set", "/film", "file", "/none/such.avi"});
    for (int i = 0; i < 100 && film()["problem"] == ""; ++i) wall.settle();
    {
        const ThreadShortage shortage;
        wall.tell({"set", "/film", "file", kRooms + "/film.avi"});
        wall.settle();
        EXPECT_NE(film()["problem"].get<std::string>().find("no room for another thread"), std::string::npos)
            << film().dump();
    }
    for (int i = 0; i < 100 && film()["problem"] != ""; ++i) wall.settle();
    EXPECT_EQ(film()["problem"], "");
}

}  // namespace
}  // namespace tessera::simulation
