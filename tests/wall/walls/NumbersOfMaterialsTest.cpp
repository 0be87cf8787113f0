/// Numbers of materials beyond their bounds, on a wall: of files they are shown with the nearest good
/// ones, of commands they are refused.
#include <gtest/gtest.h>

#include "tests/support/wall/AskedWall.h"
#include "tests/support/words/Words.h"

namespace tessera::simulation {
namespace {

TEST(NumbersOfMaterials, OfFilesAreTakenWithAWordAndOfCommandsRefusedWithTheirBounds) {
    const test::TestFolder folder;
    const std::string file = folder.write("rough.tsct",
                                          "material { name: \"m\"\n  roughness: 9 }\nnode { name: \"box\" material: "
                                          "\"m\" box { size { x: 1 y: 1 z: 1 } } }\n");
    const std::string more = folder.write(
        "more.tsct",
        "material { name: \"m\" metallic: -2 }\nnode { name: \"ball\" material: \"m\" sphere { radius: 1 } }\n");
    AskedWall wall({.scene = file, .widthPx = 160, .heightPx = 90, .server = {"--allow", folder.path()}});
    EXPECT_NE(wall.logs().find("rough.tsct:2:3: material 'm': roughness 9 is not between 0 and 1: 1 is taken"),
              std::string::npos)
        << wall.logs();

    CommandOutcome material = wall.ctl({"get", "/box", "material"});
    ASSERT_EQ(material.exitCode, 0) << material.output;
    const std::string id = material.output.substr(0, material.output.find('\n'));
    EXPECT_EQ(wall.ctl({"get", id, "roughness"}).output, "1\n");
    const CommandOutcome refused = wall.ctl({"set", id, "roughness", "9"});
    EXPECT_NE(refused.exitCode, 0);
    EXPECT_WORDS(refused.output);
    const CommandOutcome color = wall.ctl({"set", id, "baseColor", "0.5", "-0.1", "0", "1"});
    EXPECT_WORDS(color.output);
    EXPECT_EQ(wall.ctl({"get", id, "roughness"}).output, "1\n") << "what is refused changes nothing";
    EXPECT_EQ(wall.ctl({"set", id, "roughness", "0.25"}).exitCode, 0);
    EXPECT_EQ(wall.ctl({"get", id, "roughness"}).output, "0.25\n");

    const CommandOutcome loaded = wall.ctl({"load", more});
    EXPECT_EQ(loaded.exitCode, 0) << loaded.output;
    EXPECT_WORDS(loaded.output);
    EXPECT_NE(wall.ctl({"types"}).output.find("roughness"), std::string::npos);
    EXPECT_FALSE(wall.finish().is_null()) << wall.logs();
}

/// As it goes on for who has it cut: the wall shows what there is.
TEST(CutFile, IsShownByAWallWithAWordAboutIt) {
    const test::TestFolder folder;
    const std::string file =
        folder.write("part.stl",
                     "solid part\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 "
                     "0\nendloop\nendfacet\nfacet normal 0 0 1\nouter loop\nvertex 1 ");
    AskedWall wall({.scene = file, .widthPx = 160, .heightPx = 90});
    EXPECT_NE(
        wall.logs().find("part.stl: it ends within a triangle (line 9): it is cut off; 1 whole triangle is there"),
        std::string::npos)
        << wall.logs();
    EXPECT_FALSE(wall.finish().is_null()) << wall.logs();
}

}  // namespace
}  // namespace tessera::simulation
