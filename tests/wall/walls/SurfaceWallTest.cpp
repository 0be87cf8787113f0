/// A surface of control points on a wall: who pulls at its points moves picture and collision, and
/// undoes both.
#include <gtest/gtest.h>

#include "tests/support/wall/AskedWall.h"
#include "tests/support/words/Words.h"

namespace tessera::simulation {
namespace {

using nlohmann::json;

/// The block's underside is half a unit below its middle; a ten-thousandth of its size is how near it comes.
constexpr double kNear = 2e-4;

class SurfaceWall : public AskedWall {
public:
    explicit SurfaceWall(const std::string& wall)
        : AskedWall({.wall = wall, .scene = std::string(TESSERA_SOURCE_DIR) + "/tests/data/scenes/surface.tsct"}) {}
    /// Lets the block down from on high, says where it stops, and lifts it: what grows into a block holds it. Two steps
    /// of undo, and a third where it comes from elsewhere: who is there already takes none.
    [[nodiscard]] double drop(const std::string& x) {
        tell({"move", "/block", x, "6", "0"});
        const Moved moved = move("/block", {"0", "-5", "0", "--by"});
        EXPECT_TRUE(moved.stopped);
        tell({"move", "/block", x, "6", "0"});
        return moved.place.y() - 0.5;
    }
    void undo(int steps) {
        for (int i = 0; i < steps; ++i) tell({"undo"});
    }
    void pullTop(const std::string& node, const char* y) {
        tell({"set", node, "points@4", "-1", y, "1", "1", y, "1", "1", y, "-1", "-1", y, "-1"});
    }
};

TEST(SurfaceWall, PictureAndCollisionFollowTheControlPoints) {
    Picture pulled;
    {
        SurfaceWall wall("2x2");
        const Picture before = wall.settledPicture();
        EXPECT_NEAR(wall.drop("0"), 1, kNear);
        wall.pullTop("/cube/skin", "2");
        EXPECT_NEAR(wall.drop("0"), 2, kNear);
        wall.tell({"set", "/cube/skin", "points@5", "1", "3", "1"});  // one corner: the top is no plane now
        EXPECT_GT(wall.drop("0.6"), 2.1);
        wall.undo(4);
        EXPECT_NEAR(wall.drop("0"), 2, kNear) << "the pull of one corner is undone";

        // The smooth one lies inside its points, and follows them all the same.
        const double low = wall.drop("3");
        EXPECT_LT(low, 0.9);
        EXPECT_GT(low, 0.4);
        wall.pullTop("/pillow/skin", "2");
        EXPECT_GT(wall.drop("3"), low + 0.4);
        // Its level is a field like others: coarser corners lie on the same surface.
        wall.tell({"set", "/pillow/skin", "level", "1"});
        wall.tell({"set", "/pillow/skin", "scheme", "bilinear"});
        EXPECT_NEAR(wall.drop("3"), 2, kNear);

        // What a lattice bends: its top is led up, and at one side down again.
        EXPECT_NEAR(wall.drop("-3"), 1, kNear);
        wall.tell({"set", "/jelly/body", "controlPoints@2", "-1", "2", "-1", "1", "2", "-1"});
        wall.tell({"set", "/jelly/body", "controlPoints@6", "-1", "2", "1", "1", "2", "1"});
        EXPECT_NEAR(wall.drop("-3"), 2, kNear);
        wall.undo(3);
        EXPECT_GT(wall.drop("-3"), 1.4) << "the back of the top is up still";
        EXPECT_LT(wall.drop("-3"), 1.8);

        wall.tell({"move", "/block", "0", "6", "0"});
        pulled = wall.settledPicture();
        EXPECT_GT(pixelsThatDiffer(before, pulled), 500u);
        EXPECT_EQ(wall.finish()["replication"]["state_hash_mismatches"], 0);
    }
    // Four hosts have derived what one derives; it took them a dozen edits, and this one two.
    SurfaceWall one("1x1");
    one.pullTop("/cube/skin", "2");
    one.pullTop("/pillow/skin", "2");
    one.tell({"set", "/pillow/skin", "level", "1"});
    one.tell({"set", "/pillow/skin", "scheme", "bilinear"});
    one.tell({"set", "/jelly/body", "controlPoints@2", "-1", "2", "-1", "1", "2", "-1"});
    one.tell({"move", "/block", "0", "6", "0"});
    EXPECT_EQ(pixelsThatDiffer(one.settledPicture(), pulled), 0u);
    (void)one.finish();
}

TEST(SurfaceWall, WhatIsNearIsDrawnAsFineAsTheScreenWantsIt) {
    Picture near;
    {
        SurfaceWall wall("2x2");
        wall.tell({"set", "/pillow/skin", "level", "1"});
        const double low = wall.drop("3");
        wall.tell({"move", "/camera", "3", "0.2", "2"});
        near = wall.settledPicture();
        wall.tell({"set", "/pillow/skin", "screenError", "0"});
        EXPECT_GT(pixelsThatDiffer(wall.settledPicture(), near), 500u) << "its few triangles are seen";
        EXPECT_EQ(wall.drop("3"), low) << "what is drawn is nothing to collisions";
        wall.undo(3);
        EXPECT_EQ(pixelsThatDiffer(wall.settledPicture(), near), 0u) << "what was coarse meanwhile is as fine again";
        EXPECT_EQ(wall.finish()["replication"]["state_hash_mismatches"], 0);
    }
    // One host that has never seen it from elsewhere chooses as four that came near.
    SurfaceWall one("1x1");
    one.tell({"move", "/camera", "3", "0.2", "2"});
    one.tell({"set", "/pillow/skin", "level", "1"});
    one.tell({"move", "/block", "3", "6", "0"});
    EXPECT_EQ(pixelsThatDiffer(one.settledPicture(), near), 0u);
    (void)one.finish();
}

TEST(SurfaceWall, WhatIsNoControlMeshIsRefusedByName) {
    SurfaceWall wall("1x1");
    const auto refused = [&](std::vector<std::string> words) {
        const CommandOutcome outcome = wall.ctl(std::move(words));
        EXPECT_NE(outcome.exitCode, 0) << outcome.output;
        return outcome.output;
    };
    EXPECT_WORDS(refused({"set", "/cube/skin", "scheme", "loop"}));
    EXPECT_WORDS(refused({"set", "/cube/skin", "points@0", "1e36", "0", "0"}));
    EXPECT_WORDS(refused({"set", "/cube/skin", "points@8", "0", "0", "0"}));
    EXPECT_WORDS(refused({"set", "/cube/skin", "creases@0", "0", "1"}));
    EXPECT_WORDS(refused({"set", "/cube/skin", "level", "7"}));
    EXPECT_WORDS(refused({"set", "/jelly/body", "pointsX", "3"}));
    EXPECT_WORDS(refused({"set", "/jelly/body", "degreeX", "2"}));
    EXPECT_WORDS(refused({"set", "/jelly/body", "controlPoints@1", "0", "-2e30", "0"}));
    EXPECT_NEAR(wall.drop("0"), 1, kNear) << "nothing has changed";
    (void)wall.finish();
}

}  // namespace
}  // namespace tessera::simulation
