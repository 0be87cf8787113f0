/// Handles on walls of real processes: dragged by tessera-ctl, the same on all tiles, one step of undo, stopped by what is in the way.
#include <gtest/gtest.h>

#include <fstream>

#include "tests/integration/AskedWall.h"

namespace tessera::test {
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
    explicit Workshop(const std::string& wall) : AskedWall({.wall = wall, .scene = written()}), ready(start()) {}
    /// Along -Z through a place: to take hold of the handle there, and to lead it to another place.
    [[nodiscard]] nlohmann::json dragFrom(double x, double y, double toX, double toY) const {
        const auto number = [](double value) { return std::to_string(value); };
        return ask({"drag", "--rays", number(x), number(y), "4", "0", "0", "-1", number(toX), number(toY), "4", "0", "0", "-1", "--steps", "5"});
    }
    const bool ready;

private:
    [[nodiscard]] static std::string written() {
        static const TemporaryFolder folder;
        const std::string path = folder.path() + "/workshop.tsct";
        std::ofstream(path) << kWorkshop;
        return path;
    }
};

TEST(ManipulatorWall, AHandleLeadsItsTargetAndOneUndoBringsItBack) {
    Picture moved, first;
    {
        Workshop wall("2x2");
        ASSERT_TRUE(wall.ready) << wall.logs();
        first = wall.picture("first");
        const std::string depth = wall.ask({"status"})["undo_depth"].dump();
        EXPECT_EQ(depth, "0") << "handles are nobody's step";
        // The arrow up: only along its axis.
        const nlohmann::json told = wall.dragFrom(0, 0.8, 0.3, 1.2);
        EXPECT_EQ(told["path"], "/handles") << told.dump();
        const Vec3d up = wall.placeOf("/cart");
        EXPECT_NEAR(up.y(), 0.4, 1e-9);
        EXPECT_EQ(up.x(), 0);
        EXPECT_EQ(wall.ask({"status"})["undo_depth"], 1) << "five edits are one gesture";
        moved = wall.picture("moved");
        EXPECT_GT(pixelsThatDiffer(first, moved), 200u);
        wall.tell({"undo"});
        EXPECT_EQ(wall.placeOf("/cart").norm(), 0);
        EXPECT_EQ(pixelsThatDiffer(wall.picture("back"), first), 0u);
        // The arrow to the right leads into the post, 0.8 away from the box's side.
        (void)wall.dragFrom(0.8, 0, 2.8, 0);
        const double stopped = wall.placeOf("/cart").x();
        EXPECT_GT(stopped, 0.5);
        EXPECT_LE(stopped, 1.0);
        // Where there is no handle, and of what is driven, nothing is held.
        const Outcome missed = wall.wall().ctl({"drag", "--rays", "5", "5", "4", "0", "0", "-1", "6", "5", "4", "0", "0", "-1"});
        EXPECT_NE(missed.exitCode, 0);
        EXPECT_NE(missed.output.find("no handle"), std::string::npos) << missed.output;
        // Saved, there are no handles in the file, and they are there again.
        wall.tell({"undo"});
        wall.tell({"save", wall.folder() + "/saved.tsct"});
        EXPECT_EQ(wall.finish()["replication"]["state_hash_mismatches"], 0);
        AskedWall saved({.wall = "1x1", .scene = wall.folder() + "/saved.tsct"});
        ASSERT_TRUE(saved.start()) << saved.logs();
        EXPECT_EQ(pixelsThatDiffer(saved.picture("saved"), first), 0u);
        (void)saved.finish();
    }
    Workshop one("1x1");
    ASSERT_TRUE(one.ready) << one.logs();
    EXPECT_EQ(pixelsThatDiffer(one.picture("first"), first), 0u);
    (void)one.dragFrom(0, 0.8, 0.3, 1.2);
    EXPECT_EQ(pixelsThatDiffer(one.picture("moved"), moved), 0u);
    const Outcome wrong = one.wall().ctl({"set", "/handles", "target", "/post/wood"});
    EXPECT_NE(wrong.exitCode, 0);
    EXPECT_NE(wrong.output.find("wants a node whose core is"), std::string::npos) << wrong.output;
    (void)one.finish();
}

/// Whatever was held, and whatever its pieces coincide with: the picture after a drag and its undo is the one before, byte for byte.
TEST(ManipulatorWall, ADragThatIsTakenBackLeavesNoPixelBehind) {
    Workshop wall("2x2");
    ASSERT_TRUE(wall.ready) << wall.logs();
    wall.tell({"view", "--position", "1.5", "1", "2", "--look-at", "0", "0", "0", "--scale", "0.5"});
    struct Case {
        const char* kind;
        double x, y;
    };
    for (const Case& held : {Case{"move", 0, 0.8}, {"rotate", 0.707, 0.707}, {"scale", 0.8, 0}, {"trackball", 0.707, 0.707}, {"jack", 0, 0.8},
                             {"tab-box", 0.3, 0.3}, {"transformer", 0.3, 0.3}}) {
        wall.tell({"set", "/handles", "kind", held.kind});
        const std::string name = held.kind;
        const Picture before = wall.picture(name + "-before");
        (void)wall.dragFrom(held.x, held.y, held.x - 0.25, held.y + 0.2);
        EXPECT_GT(pixelsThatDiffer(wall.picture(name + "-moved"), before), 20u) << name;
        wall.tell({"undo"});
        EXPECT_TRUE(wall.picture(name + "-back") == before) << name;
    }
    // None of what is held can be referred to, and it goes on following.
    const Outcome own = wall.wall().ctl({"set", "/handles", "target", "/handles/handles/turn"});
    EXPECT_EQ(own.exitCode, 1) << own.output;
    EXPECT_NE(own.output.find("of the handles of /handles: the server makes those"), std::string::npos) << own.output;
    (void)wall.finish();
}

}  // namespace
}  // namespace tessera::test
