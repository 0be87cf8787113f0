/// Hands on the handles of a wall: of windows, consoles and applications; and what becomes of a grip when its hand is
/// cut off.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include "common/application/Application.h"
#include "common/input/HandInput.h"
#include "tests/support/wall/AskedWall.h"
#include "tests/support/words/Words.h"

namespace tessera::simulation {
namespace {

using namespace std::chrono_literals;

const std::string kStudio = std::string(TESSERA_SOURCE_DIR) + "/tests/data/scenes/handles.tsct";

/// From before the cart at its arrow that points up, and from 0.3 above.
const Ray kArrow{.origin = Vec3d(0, 0.8, 4), .direction = -Vec3d::UnitZ()};
const Ray kHigher{.origin = Vec3d(0, 1.1, 4), .direction = -Vec3d::UnitZ()};

class HandledWall {
public:
    /// `journal`: a folder; empty: none.
    explicit HandledWall(const std::string& journal = "") : wall(options(journal)) {}

    [[nodiscard]] std::unique_ptr<Application> connect(const std::string& name) {
        auto made = Application::connect({.address = toString(wall.address()), .name = name, .followScene = false},
                                         wall.platform(name));
        EXPECT_TRUE(made) << made.error().message;
        return made ? std::move(*made) : nullptr;
    }
    [[nodiscard]] bool isHeld() { return wall.ctl({"get", "/handles", "held"}).output.substr(0, 1) != "0"; }
    [[nodiscard]] double heightOfCart() { return wall.placeOf("/cart").y(); }
    template <typename Holds>
    [[nodiscard]] bool soon(const Holds& holds) {
        for (int look = 0; look < 400; ++look) {
            if (holds()) return true;
            wall.world().runFor(50ms);
        }
        return false;
    }
    [[nodiscard]] bool grabs(Application& application) {
        return soon([&] {
            const auto held = application.grab(kArrow);
            return held && held->hit;
        });
    }
    /// The topmost pixel of the middle column where a handle can be taken hold of, and some below it; -1: none.
    [[nodiscard]] int handleRow() {
        const std::unique_ptr<Application> finger = connect("finger");
        for (int row = 0; finger && row < kHeightPx; row += 2) {
            const Expected<answer::Picked> held =
                finger->grab({.xPx = kWidthPx / 2.0, .yPx = static_cast<double>(row), .wand = {}});
            if (held && held->hit) return row + 2;
        }
        return -1;
    }
    /// Takes hold of what is in this row of the middle column.
    static void take(InputState& hand, int row) {
        hand.cursorX = 65535 / 2;
        hand.cursorY = static_cast<std::uint16_t>(65535.0 * (row + 0.5) / kHeightPx);
        hand.held = kHandHolds;
        ++hand.asked[kHandTakes];
        hand.ask(InputAction::kGrab);
    }

    static constexpr int kWidthPx = 640, kHeightPx = 360;

private:
    static AskedWallOptions options(const std::string& journal) {
        return {.wall = "1x1", .scene = kStudio, .widthPx = kWidthPx, .heightPx = kHeightPx, .journal = journal};
    }

public:
    AskedWall wall;
};

TEST(HandleWall, AHostThatIsKilledWhileItsWindowHoldsAHandleHoldsNothing) {
    HandledWall here;
    const int row = here.handleRow();
    ASSERT_GT(row, 0);
    InputState hand;
    here.wall.host("all").input(hand);
    HandledWall::take(hand, row);
    here.wall.host("all").input(hand);
    ASSERT_TRUE(here.soon([&] { return here.isHeld(); })) << here.wall.logs();
    // The second one is told.
    const std::unique_ptr<Application> other = here.connect("other");
    ASSERT_TRUE(other);
    const Aim arrow{.xPx = HandledWall::kWidthPx / 2.0, .yPx = static_cast<double>(row), .wand = {}};
    const Expected<answer::Picked> refused = other->grab(arrow);
    ASSERT_FALSE(refused);
    EXPECT_WORDS(refused.error().message);
    here.wall.killHost("all");
    EXPECT_TRUE(here.soon([&] { return other->grab(arrow).has_value(); })) << "once its host is lost";
}

TEST(HandleWall, AnApplicationThatIsCutOffHoldsNothing) {
    HandledWall here;
    {
        const std::unique_ptr<Application> holder = here.connect("holder");
        ASSERT_TRUE(holder);
        ASSERT_TRUE(here.grabs(*holder)) << here.wall.logs();
        ASSERT_TRUE(here.soon([&] { return here.isHeld(); }));
    }
    EXPECT_TRUE(here.soon([&] { return !here.isHeld(); })) << "it has gone without a word";
    here.wall.tell({"drag", "--rays", "0", "0.8", "4", "0", "0", "-1", "0", "1", "4", "0", "0", "-1"});
    EXPECT_NEAR(here.heightOfCart(), 0.2, 1e-9);
    EXPECT_EQ(here.wall.finish()["faults"].size(), 0u);
}

TEST(HandleWall, NobodyHoldsAnythingAfterTheServerWasKilled) {
    const test::TestFolder folder;
    {
        HandledWall here(folder.path() + "/journal");
        const std::unique_ptr<Application> holder = here.connect("holder");
        ASSERT_TRUE(holder);
        ASSERT_TRUE(here.grabs(*holder)) << here.wall.logs();
        ASSERT_TRUE(holder->drag(kHigher));
        ASSERT_TRUE(here.soon([&] { return here.isHeld(); }));
        here.wall.killServer();
    }
    HandledWall here(folder.path() + "/journal");
    EXPECT_TRUE(here.soon([&] { return !here.isHeld(); })) << "the journal says that somebody held it";
    EXPECT_NEAR(here.heightOfCart(), 0.3, 1e-9) << "and what was granted is there";
    here.wall.tell({"drag", "--rays", "0", "1.1", "4", "0", "0", "-1", "0", "1.2", "4", "0", "0", "-1"});
    here.wall.tell({"undo"});
    here.wall.tell({"undo"});
    EXPECT_TRUE(here.soon([&] { return here.heightOfCart() == 0; })) << "two steps: the one before the end, too";
    (void)here.wall.finish();
}

/// The console: keys of a terminal, as `tessera-ctl fly` says them, take hold in the middle of the wall.
TEST(HandleWall, AHandInTheMiddleOfTheWallLeadsWhatIsThere) {
    HandledWall here;
    const std::unique_ptr<Application> pilot = here.connect("pilot");
    ASSERT_TRUE(pilot);
    // So that the arrow is in the middle.
    here.wall.tell({"view", "--position", "0", "-0.6", "4"});
    int row = -1;
    ASSERT_TRUE(here.soon([&] { return (row = here.handleRow()) > 0; })) << here.wall.logs();
    InputState hand;
    ASSERT_TRUE(pilot->navigate({.input = hand}));
    HandledWall::take(hand, row);
    ASSERT_TRUE(pilot->navigate({.input = hand}));
    ASSERT_TRUE(here.soon([&] { return here.isHeld(); })) << here.wall.logs();
    hand.lookDown -= InputState::kUnit / 20;
    ASSERT_TRUE(pilot->navigate({.input = hand}));
    EXPECT_TRUE(here.soon([&] { return here.heightOfCart() > 0.05; })) << here.heightOfCart();
    hand.held = 0;
    ASSERT_TRUE(pilot->navigate({.input = hand}));
    EXPECT_TRUE(here.soon([&] { return !here.isHeld(); }));
    EXPECT_EQ(here.wall.ask({"status"})["undo_depth"], 1);
    EXPECT_EQ(here.wall.finish()["faults"].size(), 0u);
}

}  // namespace
}  // namespace tessera::simulation
