/// Contacts drawn on the wall on request: nodes of the scene that come, are seen the same on every wall, and go.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/wall/AskedWall.h"

namespace tessera::simulation {
namespace {

using nlohmann::json;

/// A wall on which everything has come to rest, a cart against a post, and nothing drawn of it.
class RestingWall : public AskedWall {
public:
    explicit RestingWall(const std::string& name) : AskedWall({.wall = name}) {
        tell({"contacts", "--show", "none"});
        EXPECT_TRUE(move("/stop/cart", {"9", "0", "0", "--by"}).stopped);
        hash = waitForRest();
    }
    std::string hash;
};

/// The pixel's number, row by row from the upper left.
std::size_t firstThatDiffers(const Picture& a, const Picture& b) {
    const auto differs = std::ranges::mismatch(a.rgb, b.rgb);
    return static_cast<std::size_t>(differs.in1 - a.rgb.begin()) / 3;
}

TEST(ContactDisplay, ComesOnRequestLooksTheSameOnEveryWallAndGoes) {
    Picture before, shown;
    std::string hashShown;
    json marks;
    {
        RestingWall wall("2x2");
        ASSERT_FALSE(wall.hash.empty()) << wall.logs();
        before = wall.settledPicture();
        ASSERT_EQ(before.widthPx, 320);
        EXPECT_EQ(wall.ctl({"tree", "/contacts"}).exitCode, 3) << "nobody has asked yet";

        wall.tell({"contacts", "--show", "points,normals,faces"});
        wall.settle();
        marks = wall.ask({"tree", "/contacts"});
        shown = wall.settledPicture();
        hashShown = wall.ask({"status"})["state_hash"];
        EXPECT_GT(pixelsThatDiffer(before, shown), 50u);
        EXPECT_EQ(marks["children"].size(), 5u) << "balls, arrows, triangles; lines and ticks of distances";

        // Who points at a mark means what is behind it.
        const std::size_t mark = firstThatDiffers(before, shown), width = static_cast<std::size_t>(before.widthPx);
        const json hit = wall.ask({"pick", std::to_string(mark % width), std::to_string(mark / width)});
        EXPECT_EQ(hit["hit"], true);
        EXPECT_NE(hit["path"].get<std::string>().rfind("/contacts", 0), 0u) << hit.dump(2);

        wall.tell({"save", wall.folder() + "/shown.tsct"});
        const std::string saved = readText(wall.folder() + "/shown.tsct");
        EXPECT_NE(saved.find("\"cart\""), std::string::npos);
        EXPECT_EQ(saved.find("\"contacts\""), std::string::npos) << "marks are in no file";

        wall.tell({"contacts", "--show", "none"});
        wall.settle();
        EXPECT_EQ(wall.ctl({"tree", "/contacts"}).exitCode, 3) << "nobody asks any more";
        EXPECT_EQ(pixelsThatDiffer(before, wall.settledPicture()), 0u);

        // Of one interest alone: less.
        wall.tell({"contacts", "--interest", "/stop/interest", "--show", "points"});
        const Picture one = wall.settledPicture();
        EXPECT_GT(pixelsThatDiffer(before, one), 0u);
        EXPECT_LT(pixelsThatDiffer(before, one), pixelsThatDiffer(before, shown));
        ASSERT_FALSE(wall.finish().is_null());
    }
    RestingWall wall("1x1");
    ASSERT_FALSE(wall.hash.empty()) << wall.logs();
    EXPECT_EQ(pixelsThatDiffer(before, wall.settledPicture()), 0u);
    wall.tell({"contacts", "--show", "points,normals,faces"});
    EXPECT_EQ(pixelsThatDiffer(shown, wall.settledPicture()), 0u);
    EXPECT_TRUE(wall.ask({"tree", "/contacts"}) == marks) << "the same marks at the same places";
    EXPECT_EQ(wall.ask({"status"})["state_hash"], hashShown);
    ASSERT_FALSE(wall.finish().is_null());
}

}  // namespace
}  // namespace tessera::simulation
