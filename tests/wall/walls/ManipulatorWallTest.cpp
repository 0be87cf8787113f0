/// Handles on walls: dragged by tessera-ctl, the same on all tiles, one step of undo, stopped by what
/// is in the way.
#include <gtest/gtest.h>

#include "server/tools/replay/ReplayCommand.h"
#include "tests/support/wall/AskedWall.h"
#include "tests/support/words/Words.h"

namespace tessera::simulation {
namespace {

/// A box that may be moved until it meets a post, seen straight along -Z from (0, 0, 4).
constexpr const char* kWorkshop = R"(
node { name: "sun" transform { rotation { axis { x: 1 } angle_deg: -40 } } directional_light { intensity: 2 } }
node { name: "cart" transform {} node { name: "load" box { size { x: 0.6 y: 0.6 z: 0.6 } } } }
node { name: "handles" manipulator { target: "/cart" kind: MOVE size: 2 } }
node { name: "post" transform { translation { x: 1.5 } } node { name: "wood" box { size { x: 0.4 y: 2 z: 0.4 } } } }
node { name: "watch" interest { object: "/cart" against: "/post" response: STOP } }
node { name: "camera" transform { translation { z: 4 } } camera { world_units_per_metre: 2 } }
)";

class Workshop : public AskedWall {
public:
    explicit Workshop(const std::string& wall, std::vector<std::string> server = {})
        : AskedWall({.wall = wall, .scene = written(), .server = std::move(server)}) {}
    /// Along -Z through a place: to take hold of the handle there, and to lead it to another place.
    [[nodiscard]] nlohmann::json dragFrom(double x, double y, double toX, double toY) {
        const auto number = [](double value) { return std::to_string(value); };
        return ask({"drag", "--rays", number(x), number(y), "4", "0", "0", "-1", number(toX), number(toY), "4", "0",
                    "0", "-1", "--steps", "5"});
    }

private:
    [[nodiscard]] static std::string written() {
        static const test::TestFolder folder;
        return folder.write("workshop.tsct", kWorkshop);
    }
};

TEST(ManipulatorWall, AHandleLeadsItsTargetAndOneUndoBringsItBack) {
    Picture moved, first;
    {
        Workshop wall("2x2");
        first = wall.settledPicture();
        const std::string depth = wall.ask({"status"})["undo_depth"].dump();
        EXPECT_EQ(depth, "0") << "handles are nobody's step";
        // The arrow up: only along its axis.
        const nlohmann::json told = wall.dragFrom(0, 0.8, 0.3, 1.2);
        EXPECT_EQ(told["path"], "/handles") << told.dump();
        const Vec3d up = wall.placeOf("/cart");
        EXPECT_NEAR(up.y(), 0.4, 1e-9);
        EXPECT_EQ(up.x(), 0);
        EXPECT_EQ(wall.ask({"status"})["undo_depth"], 1) << "five edits are one gesture";
        moved = wall.settledPicture();
        EXPECT_GT(pixelsThatDiffer(first, moved), 200u);
        wall.tell({"undo"});
        EXPECT_EQ(wall.placeOf("/cart").norm(), 0);
        EXPECT_EQ(pixelsThatDiffer(wall.settledPicture(), first), 0u);
        // The arrow to the right leads into the post, 0.8 away from the box's side.
        (void)wall.dragFrom(0.8, 0, 2.8, 0);
        const double stopped = wall.placeOf("/cart").x();
        EXPECT_GT(stopped, 0.5);
        EXPECT_LE(stopped, 1.0);
        // Where there is no handle, and of what is driven, nothing is held.
        const CommandOutcome missed =
            wall.ctl({"drag", "--rays", "5", "5", "4", "0", "0", "-1", "6", "5", "4", "0", "0", "-1"});
        EXPECT_NE(missed.exitCode, 0);
        EXPECT_WORDS(missed.output);
        // Saved, there are no handles in the file, and they are there again.
        wall.tell({"undo"});
        wall.tell({"save", wall.folder() + "/saved.tsct"});
        EXPECT_EQ(wall.finish()["replication"]["state_hash_mismatches"], 0);
        AskedWall saved({.wall = "1x1", .scene = wall.folder() + "/saved.tsct"});
        EXPECT_EQ(pixelsThatDiffer(saved.settledPicture(), first), 0u);
        (void)saved.finish();
    }
    Workshop one("1x1");
    EXPECT_EQ(pixelsThatDiffer(one.settledPicture(), first), 0u);
    (void)one.dragFrom(0, 0.8, 0.3, 1.2);
    EXPECT_EQ(pixelsThatDiffer(one.settledPicture(), moved), 0u);
    const CommandOutcome wrong = one.ctl({"set", "/handles", "target", "/post/wood"});
    EXPECT_NE(wrong.exitCode, 0);
    EXPECT_WORDS(wrong.output);
    (void)one.finish();
}

/// The highest row of a picture that has anything of the arrow up; its height where there is none.
int topOfTheArrow(const Picture& picture) {
    for (int y = 0; y < picture.heightPx; ++y)
        for (int x = 0; x < picture.widthPx; ++x) {
            const std::size_t at = 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.widthPx) +
                                        static_cast<std::size_t>(x));
            if (picture.rgb[at + 1] > 60 + std::max(picture.rgb[at], picture.rgb[at + 2])) return y;
        }
    return picture.heightPx;
}

/// Handles of a size on the screen are as large from near and from far, and a pixel's drag takes hold of what is seen
/// there.
TEST(ManipulatorWall, HandlesOfPixelsAreAsLargeFromFarAndCanBeDraggedThere) {
    const test::TestFolder kept;
    Workshop wall("2x2", {"--record", kept.path() + "/sizes.tsr"});
    wall.tell({"set", "/handles", "size", "0"});
    wall.tell({"set", "/handles", "pixels", "120"});
    double before = 0;
    for (const char* away : {"4", "16"}) {
        wall.tell({"view", "--position", "0", "-3.4", away, "--look-at", "0", "-3.4", "0", "--scale",
                   "2"});  // the eye, 1.7 m up, is as high as the cart
        const Picture first = wall.settledPicture();
        EXPECT_NEAR(topOfTheArrow(first), 11, 2) << "60 pixels above the row of the eye, which is the 70th";
        // 30 pixels above the row of the eye, 70 from above, is the arrow, whoever has gone how far away.
        const nlohmann::json told = wall.ask({"drag", "160", "40", "160", "35"});
        EXPECT_EQ(told["path"], "/handles") << told.dump();
        const double way = wall.placeOf("/cart").y();
        EXPECT_GT(way, 1.5 * before) << "five pixels are a longer way from afar";
        before = way;
        wall.tell({"undo"});
        EXPECT_EQ(wall.placeOf("/cart").norm(), 0);
        EXPECT_EQ(pixelsThatDiffer(wall.settledPicture(), first), 0u);
    }
    const CommandOutcome wrong = wall.ctl({"set", "/handles", "sizes", "1", "1", "1", "1"});
    EXPECT_NE(wrong.exitCode, 0);
    EXPECT_WORDS(wrong.output);
    EXPECT_EQ(wall.finish()["replication"]["state_hash_mismatches"], 0);
    // Where heads were is not in a recording; how large handles were is.
    const CommandOutcome replayed = runHere([&] { return runReplay({kept / "sizes.tsr"}); });
    EXPECT_EQ(replayed.exitCode, 0) << replayed.output;
}

/// Whatever was held, and whatever its pieces coincide with: the picture after a drag and its undo is the one before,
/// byte for byte.
TEST(ManipulatorWall, ADragThatIsTakenBackLeavesNoPixelBehind) {
    Workshop wall("2x2");
    wall.tell({"view", "--position", "1.5", "1", "2", "--look-at", "0", "0", "0", "--scale", "0.5"});
    struct Case {
        const char* kind;
        double x, y;
    };
    for (const Case& held : {Case{"move", 0, 0.8},
                             {"rotate", 0.707, 0.707},
                             {"scale", 0.8, 0},
                             {"trackball", 0.707, 0.707},
                             {"jack", 0, 0.8},
                             {"tab-box", 0.3, 0.3},
                             {"transformer", 0.3, 0.3},
                             {"handle-box", 0.3, 0.3},
                             {"transform-box", 0.3, 0}}) {
        wall.tell({"set", "/handles", "kind", held.kind});
        const std::string name = held.kind;
        const Picture before = wall.settledPicture();
        (void)wall.dragFrom(held.x, held.y, held.x - 0.25, held.y + 0.2);
        EXPECT_GT(pixelsThatDiffer(wall.settledPicture(), before), 20u) << name;
        wall.tell({"undo"});
        EXPECT_TRUE(wall.settledPicture() == before) << name;
    }
    // None of what is held can be referred to, and it goes on following.
    const CommandOutcome own = wall.ctl({"set", "/handles", "target", "/handles/handles/turn"});
    EXPECT_EQ(own.exitCode, 1) << own.output;
    EXPECT_WORDS(own.output);
    (void)wall.finish();
}

}  // namespace
}  // namespace tessera::simulation
