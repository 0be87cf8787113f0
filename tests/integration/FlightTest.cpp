/// A person flies: real keys at a real window move a real wall's view, and nothing that goes wrong on the way leaves it
/// flying.
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/integration/InputDesktop.h"
#include "tests/integration/LiveWall.h"
#include "tests/unit/Eventually.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

/// What is in the middle of the picture: another thing, or another point of it, where the view has moved.
json middleOf(const LiveWall& wall) {
    const Outcome picked = wall.ctl({"--json", "pick", "80", "60"});
    EXPECT_EQ(picked.exitCode, 0) << picked.output;
    return json::parse(picked.output, nullptr, false);
}
json statusOf(const LiveWall& wall) {
    const Outcome status = wall.ctl({"--json", "status"});
    EXPECT_EQ(status.exitCode, 0) << status.output;
    return json::parse(status.output, nullptr, false);
}
/// Waits until the tile shows so many frames more.
bool showsFurther(const LiveWall& wall, int frames) {
    return wall.waitForFrame("front-0-0", wall.shownFrame("front-0-0") + frames, 20s);
}
/// The view rests: it is the same for thirty frames.
bool rests(const LiveWall& wall) {
    return eventually([&] {
        const json before = middleOf(wall);
        return showsFurther(wall, 30) && middleOf(wall) == before;
    });
}

LiveWallOptions oneTile(std::vector<std::string> server = {}) {
    return {.wall = std::string(TESSERA_SOURCE_DIR) + "/deploy/walls/1x1.wall", .server = std::move(server)};
}

/// The processes that a process has started.
std::vector<pid_t> childrenOf(pid_t parent) {
    std::vector<pid_t> children;
    for (const auto& task : std::filesystem::directory_iterator("/proc/" + std::to_string(parent) + "/task")) {
        std::istringstream list(readText(task.path() / "children"));
        for (pid_t child = 0; list >> child;) children.push_back(child);
    }
    return children;
}

/// One tile in a window on a desktop, with the pointer on it.
class WindowFlight {
public:
    explicit WindowFlight(LiveWallOptions options) : wall(options) {
        if (desktop.display().empty()) return;
        ::setenv("DISPLAY", desktop.display().c_str(), 1);
        Process& client = wall.startClient("all", {"--window"});
        ::unsetenv("DISPLAY");
        // The carriage drives for a second; then only the view moves what is in the middle of the picture.
        ready =
            wall.waitForFrame("front-0-0", 90, 60s) && eventually([&] { return !childrenOf(client.pid()).empty(); });
        // Where a window may be, but it takes its time to be there.
        desktop.pointer(400, 300);
    }
    /// Until the server hears of it: the window may not be there yet.
    bool hold(DesktopKey key) {
        return eventually([&] {
            desktop.key(key, true);
            if (eventually([&] { return statusOf(wall)["steering"] == json{"all"}; }, 1s)) return true;
            desktop.key(key, false);
            return false;
        });
    }
    TemporaryFolder folder;
    InputDesktop desktop{folder.path(), 800, 600};
    LiveWall wall;
    bool ready = false;
};

TEST(Flight, AKeyMovesTheViewAndHomeLeadsBack) {
    WindowFlight flight(oneTile());
    ASSERT_TRUE(flight.ready) << flight.wall.logs();
    EXPECT_EQ(statusOf(flight.wall)["navigation"], "fly");
    const json begun = middleOf(flight.wall);
    ASSERT_EQ(begun["hit"], true);
    ASSERT_TRUE(flight.hold(DesktopKey::kD)) << flight.wall.logs();
    EXPECT_TRUE(eventually([&] { return middleOf(flight.wall) != begun; }));
    flight.desktop.key(DesktopKey::kD, false);
    EXPECT_TRUE(rests(flight.wall)) << "a key that was let go";
    EXPECT_NE(middleOf(flight.wall), begun);
    flight.desktop.key(DesktopKey::kHome, true);
    flight.desktop.key(DesktopKey::kHome, false);
    EXPECT_TRUE(eventually([&] { return middleOf(flight.wall) == begun; }))
        << "to the very bits: " << begun << ", not " << middleOf(flight.wall);
    // A drag looks about.
    flight.desktop.button(1, true);
    for (int i = 0; i < 20; ++i) {
        flight.desktop.pointer(400 + 4 * i, 300);
        EXPECT_TRUE(showsFurther(flight.wall, 1));
    }
    flight.desktop.button(1, false);
    EXPECT_TRUE(eventually([&] { return middleOf(flight.wall) != begun; }));
    flight.desktop.key(DesktopKey::kTab, true);
    flight.desktop.key(DesktopKey::kTab, false);
    EXPECT_TRUE(eventually([&] { return statusOf(flight.wall)["navigation"] == "orbit"; }));
    EXPECT_EQ(flight.wall.finish()["faults"].size(), 0u);
}

/// Pixels in the colour of the keys' names, mixed with a little of the picture below.
std::ptrdiff_t yellow(const Picture& picture) {
    std::ptrdiff_t count = 0;
    for (std::size_t i = 0; i + 2 < picture.rgb.size(); i += 3)
        count +=
            picture.rgb[i] > 205 && picture.rgb[i + 1] > 165 && picture.rgb[i + 1] < 220 && picture.rgb[i + 2] < 125
                ? 1
                : 0;
    return count;
}

TEST(Flight, F1LaysTheKeysOverThePicture) {
    WindowFlight flight(oneTile());
    ASSERT_TRUE(flight.ready) << flight.wall.logs();
    ASSERT_TRUE(flight.hold(DesktopKey::kD)) << "the window has the keyboard: " << flight.wall.logs();
    flight.desktop.key(DesktopKey::kD, false);
    ASSERT_TRUE(rests(flight.wall));
    const auto press = [&](DesktopKey key) {
        flight.desktop.key(key, true);
        flight.desktop.key(key, false);
    };
    const std::ptrdiff_t before = yellow(flight.desktop.screenshot());
    press(DesktopKey::kF1);
    EXPECT_TRUE(eventually([&] { return yellow(flight.desktop.screenshot()) > before + 500; }));
    const Picture flies = flight.desktop.screenshot();
    press(DesktopKey::kTab);
    EXPECT_TRUE(eventually([&] { return !(flight.desktop.screenshot() == flies); })) << "the mode is another one";
    press(DesktopKey::kF1);
    EXPECT_TRUE(eventually([&] { return yellow(flight.desktop.screenshot()) < before + 50; }));
    EXPECT_EQ(flight.wall.finish()["faults"].size(), 0u);
}

TEST(Flight, AWindowThatIsKilledHoldsNothing) {
    WindowFlight flight(oneTile());
    ASSERT_TRUE(flight.ready) << flight.wall.logs();
    ASSERT_TRUE(flight.hold(DesktopKey::kD)) << flight.wall.logs();
    for (const pid_t window : childrenOf(flight.wall.client("all").pid())) ::kill(window, SIGKILL);
    EXPECT_TRUE(eventually([&] { return statusOf(flight.wall)["steering"].empty(); }));
    EXPECT_TRUE(rests(flight.wall));
    EXPECT_TRUE(flight.wall.client("all").running());
}

}  // namespace
}  // namespace tessera::test
