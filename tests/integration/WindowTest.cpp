/// Tiles in windows, on a desktop without a screen (Xvfb): what stands there, pixel by pixel, and what happens when it goes away.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <optional>
#include <thread>

#include "client/image/Picture.h"
#include "tests/integration/LiveWall.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;

const std::string kYardScene = std::string(TESSERA_SOURCE_DIR) + "/tests/data/scenes/yard.tsct";

/// An X server whose screen lies in a file in the format of xwd (X11/XWDFile.h: 25 numbers, most significant byte first, a name,
/// colours, rows).
class Desktop {
public:
    Desktop(const std::string& folder, int widthPx, int heightPx)
        : file_(folder + "/Xvfb_screen0"),
          server_(folder, "xvfb",
                  {"/usr/bin/Xvfb", "-displayfd", "1", "-screen", "0", fmt::format("{}x{}x24", widthPx, heightPx), "-fbdir", folder, "-nolisten", "tcp"}) {
        for (int i = 0; i < 600 && server_.running() && display_.empty(); ++i) {
            std::this_thread::sleep_for(50ms);
            const std::string said = server_.output();
            if (const std::size_t end = said.find('\n'); end != std::string::npos) display_ = ":" + said.substr(0, end);
        }
    }
    /// Empty: it did not start.
    [[nodiscard]] const std::string& display() const { return display_; }
    [[nodiscard]] Process& server() { return server_; }

    [[nodiscard]] Picture screenshot() const {
        const std::string bytes = readText(file_);
        const auto number = [&](std::size_t i) {
            std::uint32_t value = 0;
            for (std::size_t b = 0; b < 4; ++b) value = value << 8 | static_cast<std::uint8_t>(bytes.at(4 * i + b));
            return value;
        };
        const std::size_t pitch = number(12), from = number(0) + 12 * std::size_t{number(19)};
        Picture picture = Picture::filled(static_cast<int>(number(4)), static_cast<int>(number(5)), 0, 0, 0);
        for (std::size_t y = 0, to = 0; y < number(5); ++y)
            for (std::size_t x = 0; x < number(4); ++x)
                for (std::size_t c = 3; c-- > 0;) picture.rgb[to++] = static_cast<std::uint8_t>(bytes.at(from + y * pitch + 4 * x + c));
        return picture;
    }
    /// Until it looks like `wanted`.
    [[nodiscard]] bool waitFor(const Picture& wanted, std::chrono::seconds patience) const {
        const auto end = std::chrono::steady_clock::now() + patience;
        while (std::chrono::steady_clock::now() < end) {
            if (screenshot() == wanted) return true;
            std::this_thread::sleep_for(100ms);
        }
        return false;
    }

private:
    std::string file_, display_;
    Process server_;
};

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
        const Outcome drawn = run(folder_.path(), {program("tessera-wall"), "--wall", "2x2", "--scene", kYardScene, "--frames", "60", "--size", size, "--output", folder_.path() + "/plain"}, 120s);
        EXPECT_EQ(drawn.exitCode, 0) << drawn.output;
        const Picture wall = picture("plain/wall.png");
        Picture desktop = Picture::filled(widthPx, heightPx, 0, 0, 0);
        paste(desktop, wall, (widthPx - wall.widthPx) / 2, (heightPx - wall.heightPx) / 2);
        return desktop;
    }
    std::vector<std::string> wallOn(const std::string& display, std::vector<std::string> more) const {
        std::vector<std::string> command = {"/usr/bin/env", "DISPLAY=" + display, program("tessera-wall"), "--wall", "2x2", "--scene", kYardScene, "--output", folder_.path() + "/out", "--window"};
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
    wall.signal(SIGINT);
    EXPECT_EQ(wall.waitForExit(30s), 0) << wall.output();
    EXPECT_NE(wall.output().find(", 0 faults"), std::string::npos) << wall.output();
}

TEST_F(Windows, GoWithTheirHostsWhenThoseAreKilled) {
    Desktop desktop(folder_.path(), 800, 600);
    ASSERT_FALSE(desktop.display().empty());
    const Picture wanted = expected(800, 600, "640x360");
    Process wall(folder_.path(), "wall", wallOn(desktop.display(), {"--size", "640x360"}));
    ASSERT_TRUE(desktop.waitFor(wanted, 60s)) << wall.output();
    wall.signal(SIGKILL);  // which takes its clients along, by the same signal
    EXPECT_TRUE(desktop.waitFor(Picture::filled(800, 600, 0, 0, 0), 20s));
}

TEST_F(Windows, SayWhatTheyLack) {
    const auto window = [&](const std::string& display, std::vector<std::string> words) {
        std::vector<std::string> command = {"/usr/bin/env", "-u", "WAYLAND_DISPLAY", "-u", "SDL_VIDEODRIVER", "DISPLAY=" + display, program("tessera-window")};
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
}

}  // namespace
}  // namespace tessera::test
