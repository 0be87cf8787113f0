/// Windows of outputs: what stands on the desktop is what `tessera-wall --outputs` leaves as a picture, byte for byte.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/integration/Desktop.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;

const std::string kOutputYard = std::string(TESSERA_SOURCE_DIR) + "/tests/data/scenes/yard.tsct";

const std::string kScreenOf =
    R"(screens { name: "front" lower_left { x: -1.6 y: 0.6 z: 0 } lower_right { x: 1.6 y: 0.6 z: 0 }
  upper_left { x: -1.6 y: 2.4 z: 0 } grid { columns: COLUMNS rows: 1 tile_width_px: 200 tile_height_px: 150
    overlap_x_px: OVERLAP } }
users { name: "u" position { x: 0 y: 1.7 z: 2.4 } eye_separation_m: 0.3 }
)";

std::string screenOf(int columns, int overlapPx) {
    std::string text = kScreenOf;
    text.replace(text.find("COLUMNS"), 7, std::to_string(columns));
    return text.replace(text.find("OVERLAP"), 7, std::to_string(overlapPx));
}

/// Barrels: as projectors that hang too high are corrected.
std::string bentMeshText() {
    std::string text = "2\n9 9\n";
    for (int row = 0; row < 9; ++row) {
        for (int column = 0; column < 9; ++column) {
            const double u = column / 8.0, v = row / 8.0, x = 2 * u - 1, y = 2 * v - 1;
            text += fmt::format("{} {} {} {} {}\n", x * (1 - 0.1 * y * y) * 200 / 150, y * (1 - 0.1 * (1 - x * x)), u,
                                v, 1 - 0.2 * u);
        }
    }
    return text;
}

class OutputWindows : public testing::Test {
protected:
    Picture output(const std::string& name) {
        const Expected<Bytes> bytes = readFile(folder_.path() + "/plain/outputs/" + name + ".png", 100 << 20);
        if (!bytes) {
            ADD_FAILURE() << bytes.error().message;
            return Picture::filled(1, 1, 9, 9, 9);
        }
        return decodePng(*bytes).value().picture;
    }
    /// Draws the wall without windows, and leaves the pictures of its outputs.
    void drawPlain(const std::string& wall) {
        const Outcome drawn = run(folder_.path(),
                                  {program("tessera-wall"), "--wall", wall, "--scene", kOutputYard, "--frames", "60",
                                   "--outputs", "--output", folder_.path() + "/plain"},
                                  120s);
        ASSERT_EQ(drawn.exitCode, 0) << drawn.output;
    }
    Process windowsOf(const std::string& wall, const std::string& display) {
        return {folder_.path(),
                "wall",
                {"/usr/bin/env", "DISPLAY=" + display, program("tessera-wall"), "--wall", wall, "--scene", kOutputYard,
                 "--output", folder_.path() + "/out", "--window"}};
    }
    TemporaryFolder folder_;
};

TEST_F(OutputWindows, OfTwoEyesShowThemAsOnePicture) {
    for (const std::string stereo : {"ANAGLYPH", "SIDE_BY_SIDE_FULL", "ROWS"}) {
        const std::string wall = folder_.write("stereo-" + stereo + ".wall", screenOf(1, 0) + R"(hosts { name: "both"
  tiles { screen: "front" column: 0 row: 0 eye: LEFT user: "u" output { stereo: )" +
                                                                                 stereo + R"( } }
  tiles { screen: "front" column: 0 row: 0 eye: RIGHT user: "u" } })");
        drawPlain(wall);
        const Picture packed = output("front-0-0-left");
        EXPECT_EQ(packed.widthPx, stereo == "SIDE_BY_SIDE_FULL" ? 400 : 200);
        Desktop desktop(folder_.path(), 640, 480);
        ASSERT_FALSE(desktop.display().empty());
        Picture wanted = Picture::filled(640, 480, 0, 0, 0);
        paste(wanted, packed, (640 - packed.widthPx) / 2, (480 - packed.heightPx) / 2);
        Process windows = windowsOf(wall, desktop.display());
        EXPECT_TRUE(desktop.waitFor(wanted, 60s)) << stereo << windows.output();
        windows.signal(SIGINT);
        EXPECT_EQ(windows.waitForExit(30s), 0) << windows.output();
    }
}

TEST_F(OutputWindows, ThatAreWarpedAndBlendedStandSideBySide) {
    folder_.write("bent.warp", bentMeshText());
    const std::string wall = folder_.write("blended.wall", screenOf(2, 40) + R"(
hosts { name: "left" tiles { screen: "front" column: 0 row: 0 user: "u"
  output { warp: "bent.warp" blend: true black: 0.002 } } }
hosts { name: "right" tiles { screen: "front" column: 1 row: 0 user: "u"
  output { blend: true black: 0.002 gain { b: 0.8 } gamma { r: 2.4 } } } })");
    drawPlain(wall);
    const Picture left = output("front-0-0"), right = output("front-1-0");
    EXPECT_NE(left.rgb, right.rgb);
    Desktop desktop(folder_.path(), 640, 480);
    ASSERT_FALSE(desktop.display().empty());
    Picture wanted = Picture::filled(640, 480, 0, 0, 0);
    paste(wanted, left, 120, 165);
    paste(wanted, right, 320, 165);
    Process windows = windowsOf(wall, desktop.display());
    EXPECT_TRUE(desktop.waitFor(wanted, 60s)) << windows.output();
    windows.signal(SIGINT);
    EXPECT_EQ(windows.waitForExit(30s), 0) << windows.output();
    EXPECT_NE(windows.output().find(", 0 faults"), std::string::npos) << windows.output();
}

TEST_F(OutputWindows, GoOnWhereOneOfThemIsBad) {
    const std::string wall = folder_.write("half.wall", screenOf(2, 40) + R"(
hosts { name: "left" tiles { screen: "front" column: 0 row: 0 user: "u" output { blend: true } } }
hosts { name: "right" tiles { screen: "front" column: 1 row: 0 user: "u"
  output { blend: true monitor: "HDMI-9" } } })");
    drawPlain(wall);
    Desktop desktop(folder_.path(), 640, 480);
    ASSERT_FALSE(desktop.display().empty());
    Picture wanted = Picture::filled(640, 480, 0, 0, 0);
    paste(wanted, output("front-0-0"), 120, 165);
    Process windows = windowsOf(wall, desktop.display());
    EXPECT_TRUE(desktop.waitFor(wanted, 60s)) << windows.output();
    EXPECT_TRUE(windows.waitForText("tile front-1-0 has no window any more", 30s)) << windows.output();
    EXPECT_NE(windows.output().find("no monitor \"HDMI-9\"; there are"), std::string::npos) << windows.output();
    windows.signal(SIGINT);
    EXPECT_EQ(windows.waitForExit(30s), 0) << windows.output();
}

TEST_F(OutputWindows, OfADriverWithoutTwoEyesShowTheLeftOneAndSaySo) {
    const std::string wall = folder_.write("quad.wall", screenOf(1, 0) + R"(hosts { name: "both"
  tiles { screen: "front" column: 0 row: 0 eye: LEFT user: "u" output { stereo: QUAD_BUFFERED } }
  tiles { screen: "front" column: 0 row: 0 eye: RIGHT user: "u" } })");
    drawPlain(wall);
    const Picture both = output("front-0-0-left");
    ASSERT_EQ(both.widthPx, 400);
    Desktop desktop(folder_.path(), 640, 480);
    ASSERT_FALSE(desktop.display().empty());
    Picture left = Picture::filled(200, 150, 0, 0, 0), wanted = Picture::filled(640, 480, 0, 0, 0);
    paste(left, both, 0, 0);
    paste(wanted, left, 220, 165);
    Process windows = windowsOf(wall, desktop.display());
    EXPECT_TRUE(desktop.waitFor(wanted, 60s)) << windows.output();
    EXPECT_NE(windows.output().find("the left one is shown"), std::string::npos) << windows.output();
    windows.signal(SIGINT);
    EXPECT_EQ(windows.waitForExit(30s), 0) << windows.output();
}

}  // namespace
}  // namespace tessera::test
