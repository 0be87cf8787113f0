/// A mouse at a window of a real wall takes hold of a handle.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include "common/application/Application.h"
#include "tests/integration/InputDesktop.h"
#include "tests/integration/LiveWall.h"
#include "tests/unit/Eventually.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

const std::string kStudio = std::string(TESSERA_SOURCE_DIR) + "/tests/data/scenes/handles.tsct";
constexpr int kWidthPx = 640, kHeightPx = 360;

LiveWallOptions studio(std::vector<std::string> server = {}) {
    return {.wall = std::string(TESSERA_SOURCE_DIR) + "/deploy/walls/1x1.wall",
            .scene = kStudio,
            .size = fmt::format("{}x{}", kWidthPx, kHeightPx),
            .server = std::move(server)};
}

json asked(const LiveWall& wall, std::vector<std::string> words) {
    words.insert(words.begin(), "--json");
    const Outcome told = wall.ctl(words);
    EXPECT_EQ(told.exitCode, 0) << told.output;
    return json::parse(told.output, nullptr, false);
}
std::string fieldOf(const LiveWall& wall, const std::string& node, const std::string& field) {
    const Outcome told = wall.ctl({"get", node, field});
    EXPECT_EQ(told.exitCode, 0) << told.output;
    return told.output.substr(0, told.output.find('\n'));
}
double heightOfCart(const LiveWall& wall) {
    const std::string place = fieldOf(wall, "/cart", "translation");
    double x = 0, y = 0;
    EXPECT_EQ(std::sscanf(place.c_str(), "%lf %lf", &x, &y), 2) << place;
    return y;
}
bool isHeld(const LiveWall& wall) {
    return fieldOf(wall, "/handles", "held") != "0";
}

/// The topmost pixel of a column where a handle can be taken hold of, and some below it: of the middle one the arrow
/// that points up. -1: none.
int handleRow(const LiveWall& wall, int column = kWidthPx / 2) {
    auto finger = Application::connect({.address = wall.address(), .name = "finger", .followScene = false});
    if (!finger) return -1;
    for (int row = 0; row < kHeightPx; row += 2) {
        const Expected<answer::Picked> held =
            (*finger)->grab({.xPx = static_cast<double>(column), .yPx = static_cast<double>(row), .wand = {}});
        if (held && held->hit) return row + 2;
    }
    return -1;
}

/// The wall's one tile in a window, as large as its picture, in the middle of a desktop.
struct WindowStudio {
    explicit WindowStudio(std::vector<std::string> server = {}) : wall(studio(std::move(server))) {
        if (desktop.display().empty()) return;
        ::setenv("DISPLAY", desktop.display().c_str(), 1);
        (void)wall.startClient("all", {"--window"});
        ::unsetenv("DISPLAY");
        if (!wall.waitForFrame("front-0-0", 5, 60s)) return;
        row = handleRow(wall);
        desktop.pointer(kLeft + 20, kTop + 20);
        // Until the server hears of the window: it may not be there yet.
        ready = eventually([&] {
            desktop.key(DesktopKey::kTab, true);
            desktop.key(DesktopKey::kTab, false);
            return eventually([&] { return asked(wall, {"status"})["navigation"] != "fly"; }, 1s);
        });
    }
    void point(int x, int y) { desktop.pointer(kLeft + x, kTop + y); }
    /// Waits until the tile shows so many frames more.
    [[nodiscard]] bool showsFurther(int frames) const {
        return wall.waitForFrame("front-0-0", wall.shownFrame("front-0-0") + frames, 20s);
    }
    [[nodiscard]] json seenBeside() const { return asked(wall, {"pick", "20", "20"}); }

    static constexpr int kLeft = (800 - kWidthPx) / 2, kTop = (600 - kHeightPx) / 2;
    TemporaryFolder folder;
    InputDesktop desktop{folder.path(), 800, 600};
    LiveWall wall;
    int row = -1;
    bool ready = false;
};

TEST(HandleWindow, AMouseAtAWindowDragsAHandleAndNotTheView) {
    const TemporaryFolder folder;
    WindowStudio here({"--record", folder.path() + "/studio.tsr"});
    ASSERT_TRUE(here.ready) << here.wall.logs();
    ASSERT_GT(here.row, 0);
    const json beside = here.seenBeside();
    constexpr int kMiddle = kWidthPx / 2;
    here.point(kMiddle, here.row);
    here.desktop.button(1, true);
    ASSERT_TRUE(eventually([&] { return isHeld(here.wall); })) << here.wall.logs();
    for (int i = 1; i <= 10; ++i) {
        here.point(kMiddle, here.row - 3 * i);
        EXPECT_TRUE(here.showsFurther(1));
    }
    EXPECT_TRUE(eventually([&] { return heightOfCart(here.wall) > 0.1; })) << heightOfCart(here.wall);
    here.desktop.button(1, false);
    EXPECT_TRUE(eventually([&] { return !isHeld(here.wall); }));
    EXPECT_NEAR(handleRow(here.wall), here.row - 30, 2) << "what was grabbed has stayed below the cursor";
    EXPECT_EQ(here.seenBeside(), beside) << "the view has not moved";
    EXPECT_EQ(asked(here.wall, {"status"})["undo_depth"], 1) << "one step";
    EXPECT_EQ(here.wall.ctl({"undo"}).exitCode, 0);
    EXPECT_TRUE(eventually([&] { return heightOfCart(here.wall) == 0; }));
    // Beside the handles a drag is the view's.
    here.point(60, 60);
    here.desktop.button(1, true);
    EXPECT_TRUE(here.showsFurther(6)) << "the press is heard before the drag begins";
    for (int i = 1; i <= 20; ++i) {
        here.point(60 + 4 * i, 60);
        EXPECT_TRUE(here.showsFurther(1));
    }
    here.desktop.button(1, false);
    EXPECT_TRUE(eventually([&] { return here.seenBeside() != beside; }));
    EXPECT_EQ(heightOfCart(here.wall), 0);
    EXPECT_EQ(here.wall.finish()["faults"].size(), 0u);
    const Outcome replayed = run(folder.path(), {program("tessera-replay"), folder.path() + "/studio.tsr"});
    EXPECT_EQ(replayed.exitCode, 0) << replayed.output;
}

}  // namespace
}  // namespace tessera::test
