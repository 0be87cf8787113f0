/// Hands on the handles of a real wall: a mouse at a window, a wand, applications; and what becomes of a grip when its
/// hand is cut off.
#include <gtest/gtest.h>
#include <signal.h>

#include <filesystem>
#include <fstream>
#include <thread>

#include <fmt/format.h>

#include "common/application/Application.h"
#include "common/input/HandInput.h"
#include "tests/integration/InputDesktop.h"
#include "tests/integration/LiveWall.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

constexpr const char* kStudio = R"(
node { name: "sun" transform { rotation { axis { x: 1 } angle_deg: -40 } } directional_light { intensity: 2 } }
node { name: "cart" transform {} node { name: "load" box { size { x: 0.6 y: 0.6 z: 0.6 } } } }
node { name: "handles" manipulator { target: "/cart" kind: MOVE size: 2 } }
node { name: "far" transform { translation { z: -30 } } node { name: "backdrop" box { size { x: 200 y: 100 z: 1 } } } }
node { name: "camera" transform { translation { z: 4 } } camera { world_units_per_metre: 2 } }
)";
constexpr int kWidthPx = 640, kHeightPx = 360;

LiveWallOptions studio(std::vector<std::string> server = {}) {
    static const TemporaryFolder folder;
    const std::string path = folder.path() + "/studio.tsct";
    std::ofstream(path) << kStudio;
    return {.wall = std::string(TESSERA_SOURCE_DIR) + "/deploy/walls/1x1.wall",
            .scene = path,
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
template <typename Holds>
bool soon(const Holds& holds) {
    const auto end = std::chrono::steady_clock::now() + 40s;
    while (std::chrono::steady_clock::now() < end) {
        if (holds()) return true;
        std::this_thread::sleep_for(50ms);
    }
    return false;
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
        ready = soon([&] {
            desktop.key(DesktopKey::kTab, true);
            desktop.key(DesktopKey::kTab, false);
            std::this_thread::sleep_for(200ms);
            return asked(wall, {"status"})["navigation"] != "fly";
        });
    }
    void point(int x, int y) { desktop.pointer(kLeft + x, kTop + y); }
    [[nodiscard]] json seenBeside() const { return asked(wall, {"pick", "20", "20"}); }

    static constexpr int kLeft = (800 - kWidthPx) / 2, kTop = (600 - kHeightPx) / 2;
    TemporaryFolder folder;
    InputDesktop desktop{folder.path(), 800, 600};
    LiveWall wall;
    int row = -1;
    bool ready = false;
};

TEST(HandleWall, AMouseAtAWindowDragsAHandleAndNotTheView) {
    const TemporaryFolder folder;
    WindowStudio here({"--record", folder.path() + "/studio.tsr"});
    ASSERT_TRUE(here.ready) << here.wall.logs();
    ASSERT_GT(here.row, 0);
    const json beside = here.seenBeside();
    constexpr int kMiddle = kWidthPx / 2;
    here.point(kMiddle, here.row);
    here.desktop.button(1, true);
    ASSERT_TRUE(soon([&] { return isHeld(here.wall); })) << here.wall.logs();
    for (int i = 1; i <= 10; ++i) {
        here.point(kMiddle, here.row - 3 * i);
        std::this_thread::sleep_for(20ms);
    }
    EXPECT_TRUE(soon([&] { return heightOfCart(here.wall) > 0.1; })) << heightOfCart(here.wall);
    here.desktop.button(1, false);
    EXPECT_TRUE(soon([&] { return !isHeld(here.wall); }));
    EXPECT_NEAR(handleRow(here.wall), here.row - 30, 2) << "what was grabbed has stayed below the cursor";
    EXPECT_EQ(here.seenBeside(), beside) << "the view has not moved";
    EXPECT_EQ(asked(here.wall, {"status"})["undo_depth"], 1) << "one step";
    EXPECT_EQ(here.wall.ctl({"undo"}).exitCode, 0);
    EXPECT_TRUE(soon([&] { return heightOfCart(here.wall) == 0; }));
    // Beside the handles a drag is the view's.
    here.point(60, 60);
    here.desktop.button(1, true);
    std::this_thread::sleep_for(100ms);
    for (int i = 1; i <= 20; ++i) {
        here.point(60 + 4 * i, 60);
        std::this_thread::sleep_for(20ms);
    }
    here.desktop.button(1, false);
    EXPECT_TRUE(soon([&] { return here.seenBeside() != beside; }));
    EXPECT_EQ(heightOfCart(here.wall), 0);
    EXPECT_EQ(here.wall.finish()["faults"].size(), 0u);
    const Outcome replayed = run(folder.path(), {program("tessera-replay"), folder.path() + "/studio.tsr"});
    EXPECT_EQ(replayed.exitCode, 0) << replayed.output;
}

TEST(HandleWall, AHostThatIsKilledWhileItsWindowHoldsAHandleHoldsNothing) {
    WindowStudio here;
    ASSERT_TRUE(here.ready) << here.wall.logs();
    here.point(kWidthPx / 2, here.row);
    here.desktop.button(1, true);
    ASSERT_TRUE(soon([&] { return isHeld(here.wall); })) << here.wall.logs();
    // Who comes second is told.
    auto other = Application::connect({.address = here.wall.address(), .name = "other", .followScene = false});
    ASSERT_TRUE(other) << other.error().message;
    const Aim arrow{.xPx = kWidthPx / 2.0, .yPx = static_cast<double>(here.row), .wand = {}};
    const Expected<answer::Picked> refused = (*other)->grab(arrow);
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.find("somebody else holds /handles"), std::string::npos)
        << refused.error().message;
    here.wall.client("all").signal(SIGKILL);
    EXPECT_TRUE(soon([&] { return (*other)->grab(arrow).has_value(); })) << "once its host is lost";
}

TEST(HandleWall, AnApplicationThatIsCutOffHoldsNothing) {
    LiveWall wall(studio());
    wall.startClient("all", {"--surface", "none"});
    const Ray arrow{.origin = Vec3d(0, 0.8, 4), .direction = -Vec3d::UnitZ()};
    {
        auto holder = Application::connect({.address = wall.address(), .name = "holder", .followScene = false});
        ASSERT_TRUE(holder) << holder.error().message;
        ASSERT_TRUE(soon([&] {
            const auto held = (*holder)->grab(arrow);
            return held && held->hit;
        })) << wall.logs();
        ASSERT_TRUE(soon([&] { return isHeld(wall); }));
    }
    EXPECT_TRUE(soon([&] { return !isHeld(wall); })) << "it has gone without a word";
    const Outcome dragged =
        wall.ctl({"drag", "--rays", "0", "0.8", "4", "0", "0", "-1", "0", "1", "4", "0", "0", "-1"});
    EXPECT_EQ(dragged.exitCode, 0) << dragged.output;
    EXPECT_NEAR(heightOfCart(wall), 0.2, 1e-9);
    EXPECT_EQ(wall.finish()["faults"].size(), 0u);
}

TEST(HandleWall, NobodyHoldsAnythingAfterTheServerWasKilled) {
    const TemporaryFolder folder;
    const std::vector<std::string> journal{"--journal", folder.path() + "/journal"};
    const Ray arrow{.origin = Vec3d(0, 0.8, 4), .direction = -Vec3d::UnitZ()},
        higher{.origin = Vec3d(0, 1.1, 4), .direction = -Vec3d::UnitZ()};
    {
        LiveWall wall(studio(journal));
        wall.startClient("all", {"--surface", "none"});
        auto holder = Application::connect({.address = wall.address(), .name = "holder", .followScene = false});
        ASSERT_TRUE(holder) << holder.error().message;
        ASSERT_TRUE(soon([&] {
            const auto held = (*holder)->grab(arrow);
            return held && held->hit;
        })) << wall.logs();
        ASSERT_TRUE((*holder)->drag(higher));
        ASSERT_TRUE(soon([&] { return isHeld(wall); }));
        wall.server().signal(SIGKILL);
        ASSERT_TRUE(wall.server().waitForExit(20s));
    }
    LiveWall wall(studio(journal));
    wall.startClient("all", {"--surface", "none"});
    EXPECT_TRUE(soon([&] { return !isHeld(wall); })) << "the journal says that somebody held it";
    EXPECT_NEAR(heightOfCart(wall), 0.3, 1e-9) << "and what was granted is there";
    const Outcome dragged =
        wall.ctl({"drag", "--rays", "0", "1.1", "4", "0", "0", "-1", "0", "1.2", "4", "0", "0", "-1"});
    EXPECT_EQ(dragged.exitCode, 0) << dragged.output;
    EXPECT_EQ(wall.ctl({"undo"}).exitCode, 0);
    EXPECT_EQ(wall.ctl({"undo"}).exitCode, 0);
    EXPECT_TRUE(soon([&] { return heightOfCart(wall) == 0; })) << "two steps: the one before the end, too";
    (void)wall.finish();
}

/// The console: keys of a terminal, as `tessera-ctl fly` says them, take hold in the middle of the wall.
TEST(HandleWall, AHandInTheMiddleOfTheWallLeadsWhatIsThere) {
    LiveWall wall(studio());
    wall.startClient("all", {"--surface", "none"});
    auto pilot = Application::connect({.address = wall.address(), .name = "pilot", .followScene = false});
    ASSERT_TRUE(pilot) << pilot.error().message;
    // So that the arrow is in the middle.
    const Outcome view = wall.ctl({"view", "--position", "0", "-0.6", "4"});
    ASSERT_EQ(view.exitCode, 0) << view.output;
    int row = -1;
    ASSERT_TRUE(soon([&] { return (row = handleRow(wall)) > 0; })) << wall.logs();
    InputState hand;
    ASSERT_TRUE((*pilot)->navigate({.input = hand}));
    hand.cursorY = static_cast<std::uint16_t>(65535.0 * (row + 0.5) / kHeightPx);
    hand.held = kHandHolds;
    ++hand.asked[kHandTakes];
    hand.ask(InputAction::kGrab);
    ASSERT_TRUE((*pilot)->navigate({.input = hand}));
    ASSERT_TRUE(soon([&] { return isHeld(wall); })) << wall.logs();
    hand.lookDown -= InputState::kUnit / 20;
    ASSERT_TRUE((*pilot)->navigate({.input = hand}));
    EXPECT_TRUE(soon([&] { return heightOfCart(wall) > 0.05; })) << heightOfCart(wall);
    hand.held = 0;
    ASSERT_TRUE((*pilot)->navigate({.input = hand}));
    EXPECT_TRUE(soon([&] { return !isHeld(wall); }));
    EXPECT_EQ(asked(wall, {"status"})["undo_depth"], 1);
    EXPECT_EQ(wall.finish()["faults"].size(), 0u);
}

}  // namespace
}  // namespace tessera::test
