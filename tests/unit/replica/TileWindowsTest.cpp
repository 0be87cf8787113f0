// What windows say to their host: a shell plays the window, and its script lies where the picture would.
#include "client/replica/TileWindows.h"

#include <gtest/gtest.h>
#include <linux/close_range.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "common/base/Channel.h"
#include "tests/unit/Eventually.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;

/// A wall of one tile whose window is this script; what it says on descriptor 3 is heard.
class Played {
public:
    explicit Played(const std::string& script) {
        folder_ = std::filesystem::temp_directory_path() /
                  ("tile-windows-" + std::to_string(::getpid()) + "-" + std::to_string(++count_));
        std::filesystem::create_directories(folder_ / "tiles/front-0-0");
        std::ofstream(folder_ / "tiles/front-0-0/shown.frame") << script;
        Screen screen;
        screen.name = "front";
        wall_.screens = {screen};
        wall_.users = {{.name = "viewer"}};
        wall_.hosts = {{"host", {{"front", 0, 0, Eye::kCenter, "viewer"}}}};
        windows_.emplace(TileWindowsOptions{.program = "/bin/sh", .output = folder_.string()}, log_,
                         [this](const InputState& state) { heard_.push(state); });
        windows_->follow(wall_, tilesOf(wall_, "host"));
    }
    ~Played() {
        windows_.reset();
        std::filesystem::remove_all(folder_);
    }
    /// All that is heard until nothing is for two seconds.
    std::vector<InputState> heard() {
        std::vector<InputState> states;
        while (const std::optional<InputState> state = heard_.popFor(2s)) states.push_back(*state);
        return states;
    }

private:
    static inline std::atomic<int> count_ = 0;
    std::filesystem::path folder_;
    Wall wall_;
    Log log_{"test"};
    Channel<InputState> heard_{1 << 20};
    std::optional<TileWindows> windows_;
};

/// '0' is 0x30: a state in which all is held, and nothing is wrong.
const std::string kState = "printf '%0120d' 0 >&3\n";

TEST(TileWindows, AStateIsHeardAndReleasedWhenItsWindowEnds) {
    Played window(kState);
    const std::vector<InputState> heard = window.heard();
    ASSERT_EQ(heard.size(), 2u);
    EXPECT_EQ(heard[0].source, 0u) << "the host knows its windows, whatever they call themselves";
    EXPECT_EQ(heard[0].right, 0x3030);
    EXPECT_EQ(heard[1].right, 0);
    EXPECT_TRUE(heard[1].atRest());
    EXPECT_EQ(heard[1].wheel, heard[0].wheel) << "what has been done stays done";
}

TEST(TileWindows, GarbageEndsTheHearingAndTheWindowStays) {
    for (const std::string garbage : {"printf 'x' >&3\n", "printf '%0121d' 0 >&3\n", "printf '%09000d' 0 >&3\n"}) {
        Played window(kState + garbage + kState + "exec sleep 20\n");
        const std::vector<InputState> heard = window.heard();
        ASSERT_EQ(heard.size(), 2u) << garbage;
        EXPECT_TRUE(heard[1].atRest());
    }
}

TEST(TileWindows, AFloodIsCutShort) {
    Played window("while :; do printf '%0120d' 0 >&3 || exit; done\n");
    const std::vector<InputState> heard = window.heard();
    ASSERT_FALSE(heard.empty());
    EXPECT_TRUE(heard.back().atRest());
    EXPECT_LE(heard.size(), 60 * TileWindows::kMaxStatesPerSecond);
}

TEST(TileWindows, WhereNobodyListensThereIsNoSocket) {
    // What this program itself was given, by whoever runs tests, is none of its windows' business.
    ::close_range(3, ~0U, CLOSE_RANGE_CLOEXEC);
    Log log("test");
    const auto folder = std::filesystem::temp_directory_path() / ("tile-windows-deaf-" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder / "tiles/front-0-0");
    std::ofstream(folder / "tiles/front-0-0/shown.frame")
        << "printf x >&3 2>/dev/null && touch " << (folder / "heard").string() << "\ntouch "
        << (folder / "done").string() << "\n";
    Wall wall;
    wall.screens = {{.name = "front"}};
    wall.users = {{.name = "viewer"}};
    wall.hosts = {{"host", {{"front", 0, 0, Eye::kCenter, "viewer"}}}};
    TileWindows windows({.program = "/bin/sh", .output = folder.string()}, log);
    windows.follow(wall, tilesOf(wall, "host"));
    EXPECT_TRUE(test::eventually([&] { return std::filesystem::exists(folder / "done"); }));
    EXPECT_FALSE(std::filesystem::exists(folder / "heard"));
    std::filesystem::remove_all(folder);
}

/// Two screens of one host, whose windows leave their arguments.
struct TwoScreens {
    TwoScreens() {
        wall.screens = {{.name = "front"}, {.name = "floor"}};
        wall.users = {{.name = "viewer"}};
        wall.hosts = {{"host", {{"front", 0, 0, Eye::kCenter, "viewer"}, {"floor", 0, 0, Eye::kCenter, "viewer"}}}};
        for (const char* tile : {"front-0-0", "floor-0-0"}) {
            std::filesystem::create_directories(folder / "tiles" / tile);
            std::ofstream(folder / "tiles" / tile / "shown.frame")
                << "echo \"$@\" > $0.part && mv $0.part $0.said; exec sleep 20\n";
        }
    }
    ~TwoScreens() {
        // A window that is ended leaves its mv behind, which may still be renaming.
        std::error_code busy;
        (void)test::eventually([&] {
            std::filesystem::remove_all(folder, busy);
            return !std::filesystem::exists(folder, busy);
        });
    }
    std::string said(const std::string& tile) const {
        const auto file = folder / "tiles" / tile / "shown.frame.said";
        (void)test::eventually([&] { return std::filesystem::exists(file); });
        std::string text;
        std::ifstream in(file);
        std::getline(in, text);
        return text;
    }
    /// What the log has to say when these options meet the wall twice.
    std::string warningsWith(TileWindowsOptions options) {
        std::FILE* const file = std::tmpfile();
        Log log("test", file);
        {
            options.program = "/bin/sh";
            options.output = folder.string();
            TileWindows windows(options, log);
            windows.follow(wall, tilesOf(wall, "host"));
            windows.follow(wall, tilesOf(wall, "host"));
            said("front-0-0");
            said("floor-0-0");
        }
        EXPECT_TRUE(log.flush(10s));
        std::rewind(file);
        std::string text(4096, ' ');
        text.resize(std::fread(text.data(), 1, text.size(), file));
        std::fclose(file);
        return text;
    }
    std::filesystem::path folder =
        std::filesystem::temp_directory_path() / ("tile-windows-two-" + std::to_string(::getpid()));
    Wall wall;
};

TEST(TileWindows, OfTwoScreensStandBesideEachOther) {
    TwoScreens two;
    EXPECT_EQ(two.warningsWith({}), "");
    EXPECT_NE(two.said("front-0-0").find("--part 0 0 960 540 1950 540"), std::string::npos) << two.said("front-0-0");
    EXPECT_NE(two.said("floor-0-0").find("--part 990 0 960 540 1950 540"), std::string::npos) << two.said("floor-0-0");
}

TEST(TileWindows, ThatCoverOneMonitorAndMonitorsTooManyAreSaidOnce) {
    TwoScreens two;
    const std::string many = two.warningsWith({.monitors = {"0", "0", "0"}});
    EXPECT_NE(many.find("3 monitors are named, and there are 2 outputs to show"), std::string::npos) << many;
    EXPECT_EQ(std::count(many.begin(), many.end(), '\n'), 1) << many;
    const std::string first = two.warningsWith({.fullScreen = true});
    EXPECT_NE(first.find("tiles front-0-0 and floor-0-0 both take all of the first monitor"), std::string::npos)
        << first;
    EXPECT_EQ(std::count(first.begin(), first.end(), '\n'), 1) << first;
    two.wall.hosts[0].tiles[1].output.monitor = "DP-1";
    EXPECT_NE(two.warningsWith({.fullScreen = true, .monitors = {"DP-1"}}).find("all of monitor \"DP-1\""),
              std::string::npos);
    EXPECT_EQ(two.warningsWith({.fullScreen = true, .monitors = {"DP-1", "DP-2"}}), "");
}

}  // namespace
}  // namespace tessera
