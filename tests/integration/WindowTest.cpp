/// Tiles in windows, on a desktop without a screen (Xvfb): what stands there, pixel by pixel, and what happens when it
/// goes away.
#include <gtest/gtest.h>

#include <fstream>

#include "tests/integration/Desktop.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;

const std::string kYardScene = std::string(TESSERA_SOURCE_DIR) + "/tests/data/scenes/yard.tsct";

class Windows : public testing::Test {
protected:
    Picture picture(const std::string& file) {
        const Expected<Bytes> bytes = readFile(folder_.path() + "/" + file, 100 << 20);
        if (!bytes) {
            ADD_FAILURE() << bytes.error().message;
            return {};
        }
        return decodePng(*bytes).value().picture;
    }
    /// The whole wall, drawn without windows, in the middle of a black desktop.
    Picture expected(int widthPx, int heightPx, const std::string& size) {
        const Outcome drawn = run(folder_.path(),
                                  {program("tessera-wall"), "--wall", "2x2", "--scene", kYardScene, "--frames", "60",
                                   "--size", size, "--output", folder_.path() + "/plain"},
                                  120s);
        EXPECT_EQ(drawn.exitCode, 0) << drawn.output;
        const Picture wall = picture("plain/wall.png");
        Picture desktop = Picture::filled(widthPx, heightPx, 0, 0, 0);
        paste(desktop, wall, (widthPx - wall.widthPx) / 2, (heightPx - wall.heightPx) / 2);
        return desktop;
    }
    std::vector<std::string> wallOn(const std::string& display, std::vector<std::string> more) const {
        std::vector<std::string> command = {
            "/usr/bin/env", "DISPLAY=" + display, program("tessera-wall"), "--wall",  "2x2", "--scene",
            kYardScene,     "--output",           folder_.path() + "/out", "--window"};
        command.insert(command.end(), more.begin(), more.end());
        return command;
    }
    TemporaryFolder folder_;
};

TEST_F(Windows, OfAWallAreItsPicturePixelByPixelAndEndWithIt) {
    Desktop desktop(folder_.path(), 800, 600);
    ASSERT_FALSE(desktop.display().empty()) << desktop.server().output();
    const Picture wanted = expected(800, 600, "640x360");
    Process wall(folder_.path(), "wall", wallOn(desktop.display(), {"--size", "640x360"}));
    EXPECT_TRUE(desktop.waitFor(wanted, 60s)) << wall.output();
    wall.signal(SIGINT);
    EXPECT_EQ(wall.waitForExit(30s), 0) << wall.output();
    EXPECT_TRUE(desktop.waitFor(Picture::filled(800, 600, 0, 0, 0), 20s));
}

TEST_F(Windows, ThatLoseTheirDisplayCostTheWallNothing) {
    auto desktop = std::make_unique<Desktop>(folder_.path(), 800, 600);
    ASSERT_FALSE(desktop->display().empty());
    const Picture wanted = expected(800, 600, "640x360");
    Process wall(folder_.path(), "wall", wallOn(desktop->display(), {"--size", "640x360"}));
    EXPECT_TRUE(desktop->waitFor(wanted, 60s)) << wall.output();
    desktop.reset();
    EXPECT_TRUE(wall.waitForText("has no window any more", 30s)) << wall.output();
    EXPECT_EQ(wall.output().find("killed by signal"), std::string::npos) << wall.output();
    wall.signal(SIGINT);
    EXPECT_EQ(wall.waitForExit(30s), 0) << wall.output();
    EXPECT_NE(wall.output().find(", 0 faults"), std::string::npos) << wall.output();
}

TEST_F(Windows, GoWithTheirHostsWhenThoseAreKilled) {
    Desktop desktop(folder_.path(), 800, 600);
    ASSERT_FALSE(desktop.display().empty());
    const Picture wanted = expected(800, 600, "640x360");
    Process wall(folder_.path(), "wall", wallOn(desktop.display(), {"--size", "640x360"}));
    ASSERT_TRUE(desktop.waitFor(wanted, 60s)) << desktop.difference(wanted) << "\n" << wall.output();
    wall.signal(SIGKILL);  // which takes its clients along, by the same signal
    const Picture black = Picture::filled(800, 600, 0, 0, 0);
    EXPECT_TRUE(desktop.waitFor(black, 20s)) << desktop.difference(black) << "\n" << wall.output();
}

TEST_F(Windows, SayWhatTheyLack) {
    const auto window = [&](const std::string& display, std::vector<std::string> words) {
        std::vector<std::string> command = {
            "/usr/bin/env",           "-u", "WAYLAND_DISPLAY", "-u", "SDL_VIDEODRIVER", "DISPLAY=" + display,
            program("tessera-window")};
        command.insert(command.end(), words.begin(), words.end());
        return run(folder_.path(), command, 30s);
    };
    const Outcome none = window("", {"x/shown.frame"});
    EXPECT_EQ(none.exitCode, 1);
    EXPECT_NE(none.output.find("no display"), std::string::npos) << none.output;
    Desktop desktop(folder_.path(), 640, 480);
    ASSERT_FALSE(desktop.display().empty());
    const Outcome monitor = window(desktop.display(), {"x/shown.frame", "--monitor", "HDMI-9"});
    EXPECT_NE(monitor.exitCode, 0);
    EXPECT_NE(monitor.output.find("HDMI-9"), std::string::npos) << monitor.output;
    EXPECT_NE(monitor.output.find("640x480"), std::string::npos) << monitor.output;
    EXPECT_EQ(window(desktop.display(), {"x/shown.frame", "--part", "10", "0", "20", "20", "25", "20"}).exitCode, 2);
    EXPECT_EQ(window(desktop.display(), {}).exitCode, 2);
    const Outcome list = window(desktop.display(), {"--monitors"});
    EXPECT_EQ(list.exitCode, 0) << list.output;
    EXPECT_NE(list.output.find("640x480"), std::string::npos) << list.output;
    std::ofstream(folder_.path() + "/text.frame") << std::string(100'000, 'x');
    Process other(
        folder_.path(), "other",
        {"/usr/bin/env", "DISPLAY=" + desktop.display(), program("tessera-window"), folder_.path() + "/text.frame"});
    EXPECT_TRUE(other.waitForText("not the shown image of a Tessera host", 20s)) << other.output();
}

TEST_F(Windows, ThatCannotOpenEndTheirHostBeforeItDials) {
    // Else it would draw what nobody sees, and the wall would call it sound.
    const auto client = [&](const std::string& display, const std::string& monitor) {
        return run(folder_.path(),
                   {"/usr/bin/env", "-u", "WAYLAND_DISPLAY", "-u", "SDL_VIDEODRIVER", "DISPLAY=" + display,
                    program("tessera-client"), "--server", "127.0.0.1:1", "--host", "a", "--window", monitor},
                   30s);
    };
    const Outcome none = client("", "0");
    EXPECT_EQ(none.exitCode, 1) << none.output;
    EXPECT_NE(none.output.find("no display to open a window on"), std::string::npos) << none.output;
    EXPECT_EQ(none.output.find("dialling"), std::string::npos) << none.output;
    std::vector<std::string> alone = {"/usr/bin/env", "-u", "WAYLAND_DISPLAY", "-u", "SDL_VIDEODRIVER"};
    for (const std::string& word : wallOn("", {"--size", "640x360"})) alone.push_back(word);
    const Outcome wall = run(folder_.path(), alone, 60s);
    EXPECT_EQ(wall.exitCode, 1) << wall.output;
    EXPECT_NE(wall.output.find("no display to open a window on"), std::string::npos) << wall.output;
    EXPECT_NE(wall.output.find("no render host is left"), std::string::npos) << wall.output;
    Desktop desktop(folder_.path(), 640, 480);
    ASSERT_FALSE(desktop.display().empty());
    const Outcome monitor = client(desktop.display(), "HDMI-9");
    EXPECT_EQ(monitor.exitCode, 1) << monitor.output;
    EXPECT_NE(monitor.output.find("no monitor is called \"HDMI-9\""), std::string::npos) << monitor.output;
}

}  // namespace
}  // namespace tessera::test
