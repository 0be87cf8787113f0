/// More and wider lines than a screen bears, on a wall: no host is late, each says once what it does,
/// and tiles are of one picture.
#include <gtest/gtest.h>

#include <optional>

#include "tests/support/wall/AskedWall.h"

namespace tessera::simulation {
namespace {

TEST(WideLines, AreNarrowedOnAllTilesAlikeAndEachHostSaysSoOnce) {
    const test::TestFolder folder;
    const std::string scene = folder.write(
        "edges.tsct",
        "material { name: \"edges\" base_color { r: 0.2 g: 0.75 b: 0.35 } fill: EDGES line_width: 60 }\n"
        "material { name: \"rope\" base_color { r: 0.8 g: 0.2 b: 0.1 } fill: EDGES line_width: 20 }\n"
        "node { name: \"ring\" transform { translation { y: 1.5 z: -1.5 } rotation { axis { x: 1 y: 0 z: 0 } "
        "angle_deg: 50 } } material: \"edges\"\n"
        "  torus { ring_radius: 0.8 pipe_radius: 0.3 ring_segments: 256 pipe_segments: 160 } }\n"
        "node { transform { translation { x: -1 y: 1.5 z: -1 } } material: \"rope\" box { size { x: 0.5 y: 0.5 z: "
        "0.5 } } }\n");
    std::optional<Picture> one;
    for (const char* shipped : {"1x1", "2x2"}) {
        AskedWall wall({.wall = shipped, .scene = scene, .widthPx = 640, .heightPx = 360});
        const Picture seen = wall.settledPicture();
        // Another picture, that is narrowed again.
        wall.tell({"move", "/ring", "0", "1.51", "-1.5"});
        wall.settle();
        if (!one) one = seen;
        EXPECT_EQ(pixelsThatDiffer(seen, *one), 0u) << shipped;
        (void)wall.finish();
        for (const auto& [name, host] : wall.hosts()) {
            const std::string said = host->log();
            const std::size_t first = said.find("pixels wide in place of 60");
            EXPECT_NE(first, std::string::npos) << said;
            EXPECT_EQ(said.find("pixels wide in place of", first + 1), std::string::npos) << said;
        }
    }
}

}  // namespace
}  // namespace tessera::simulation
