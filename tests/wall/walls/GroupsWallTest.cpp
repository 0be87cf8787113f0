/// Levels, billboards and handles depend on who looks: the same on all tiles, and each user's own.
#include <gtest/gtest.h>

#include <algorithm>

#include "common/image/Picture.h"
#include "tests/support/wall/AskedWall.h"

namespace tessera::simulation {
namespace {

// Material groups, levels, billboards, beacons on what moves: no seam, whatever the tiles.
TEST(Groups, AWallOfTilesIsTheOnePicture) {
    const std::string scene = std::string(TESSERA_SOURCE_DIR) + "/deploy/scenes/groups.tsct";
    const auto drawn = [&](const std::string& wall) {
        return SimulatedWall({.scene = scene, .wall = wall, .widthPx = 322, .heightPx = 182}).pictureOf(7);
    };
    const Picture one = drawn("1x1");
    for (const char* wall : {"2x2", "3x1"}) EXPECT_TRUE(one == drawn(wall)) << wall;
}

std::size_t pixelsOfChannel(const Picture& p, int channel) {
    std::size_t count = 0;
    for (std::size_t i = 0; i + 2 < p.rgb.size(); i += 3) {
        const auto at = [&](int c) { return int{p.rgb[i + static_cast<std::size_t>(c)]}; };
        count += at(channel) > 200 && at((channel + 1) % 3) < 60 && at((channel + 2) % 3) < 60;
    }
    return count;
}

// Two heads before one screen, drawn once for each. The ball is 3.06 m from the one and 3.65 m from the other, with a
// range between. The plate, a metre wide and a metre behind the screen, faces both: its picture is 66.7 pixels wide for
// who stands before it, and for who stands aside 80.8, where it would be 66.7 if it stood as it is.
TEST(Groups, EachUserHasTheirOwnLevelsAndFacings) {
    const test::TestFolder folder;
    const std::string scene = folder.write("scene.tsct", R"(
        material { name: "red" base_color { r: 1 g: 0 b: 0 } unlit: true }
        material { name: "green" base_color { r: 0 g: 1 b: 0 } unlit: true }
        material { name: "blue" base_color { r: 0 g: 0 b: 1 } unlit: true }
        node { environment { background { } } }
        node { camera { } }
        node { transform { translation { y: 0.6 z: -1 } } distance_lod { range: 3.35 hysteresis: 0.01 }
          node { material: "red" sphere { radius: 0.15 } }
          node { material: "green" sphere { radius: 0.15 } } }
        node { transform { translation { z: -1 } } billboard { }
          node { material: "blue" box { size { x: 1 y: 0.5 z: 0.002 } } } })");
    const std::string wall = folder.write("users.wall", R"(
        screens { name: "middle" lower_left { x: -1.5 y: -1 z: 0 } lower_right { x: 1.5 y: -1 z: 0 }
          upper_left { x: -1.5 y: 1 z: 0 }
          grid { columns: 1 rows: 1 tile_width_px: 300 tile_height_px: 200 } }
        screens { name: "aside" lower_left { x: -1.5 y: -1 z: 0 } lower_right { x: 1.5 y: -1 z: 0 }
          upper_left { x: -1.5 y: 1 z: 0 }
          grid { columns: 1 rows: 1 tile_width_px: 300 tile_height_px: 200 } }
        users { name: "first" position { x: 0 y: 0 z: 2 } eye_separation_m: 0.06 }
        users { name: "second" position { x: 2 y: 0 z: 2 } eye_separation_m: 0.06 }
        hosts { name: "one" tiles { screen: "middle" column: 0 row: 0 eye: CENTER user: "first" }
                            tiles { screen: "aside" column: 0 row: 0 eye: CENTER user: "second" } })");
    SimulatedWall users({.scene = scene, .wall = wall, .widthPx = 0});
    (void)users.pictureOf(7);
    const Picture first = users.tilePicture("middle-0-0"), second = users.tilePicture("aside-0-0");
    EXPECT_GT(pixelsOfChannel(first, 0), 100u);
    EXPECT_EQ(pixelsOfChannel(first, 1), 0u);
    EXPECT_EQ(pixelsOfChannel(second, 0), 0u);
    EXPECT_GT(pixelsOfChannel(second, 1), 100u);
    const auto widthOf = [](const Picture& p) {
        const std::size_t row = static_cast<std::size_t>(p.widthPx) * 3;
        Picture middle = Picture::filled(p.widthPx, 1, 0, 0, 0);
        std::copy_n(p.rgb.begin() + static_cast<std::ptrdiff_t>(100 * row), row, middle.rgb.begin());
        return static_cast<double>(pixelsOfChannel(middle, 2));
    };
    EXPECT_NEAR(widthOf(first), 66.7, 1.5);
    EXPECT_NEAR(widthOf(second), 80.8, 1.5);
}

/// 60 pixels for who stands near and for who stands far away, of one thing.
TEST(Groups, EachUserSeesHandlesOfTheirOwnSize) {
    const test::TestFolder folder;
    const std::string scene = folder.write("handles.tsct", R"(
        node { environment { background { } } }
        node { camera { } }
        node { name: "thing" transform { translation { z: -2 } } }
        node { manipulator { target: "/thing" kind: JACK pixels: 60 } })");
    const std::string wall = folder.write("depths.wall", R"(
        screens { name: "middle" lower_left { x: -1.5 y: -1 z: 0 } lower_right { x: 1.5 y: -1 z: 0 }
          upper_left { x: -1.5 y: 1 z: 0 }
          grid { columns: 1 rows: 1 tile_width_px: 300 tile_height_px: 200 } }
        screens { name: "aside" lower_left { x: -1.5 y: -1 z: 0 } lower_right { x: 1.5 y: -1 z: 0 }
          upper_left { x: -1.5 y: 1 z: 0 }
          grid { columns: 1 rows: 1 tile_width_px: 300 tile_height_px: 200 } }
        users { name: "first" position { x: 0 y: 0 z: 2 } eye_separation_m: 0.06 }
        users { name: "second" position { x: 0 y: 0 z: 4 } eye_separation_m: 0.06 }
        hosts { name: "one" tiles { screen: "middle" column: 0 row: 0 eye: CENTER user: "first" }
                            tiles { screen: "aside" column: 0 row: 0 eye: CENTER user: "second" } })");
    SimulatedWall depths({.scene = scene, .wall = wall, .widthPx = 0});
    // The wall's first frame shows them so already: nobody sees them grow.
    for (const std::uint64_t frame : {0, 3}) {
        (void)depths.pictureOf(frame);
        for (const std::string screen : {"middle", "aside"}) {
            const Picture seen = depths.tilePicture(screen + "-0-0");
            int first = seen.widthPx, last = -1;
            for (int y = 0; y < seen.heightPx; ++y)
                for (int x = 0; x < seen.widthPx; ++x) {
                    const std::size_t at = 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(seen.widthPx) +
                                                static_cast<std::size_t>(x));
                    if (seen.rgb[at] + seen.rgb[at + 1] + seen.rgb[at + 2] < 60) continue;
                    first = std::min(first, x);
                    last = std::max(last, x);
                }
            EXPECT_NEAR(last - first + 1, 63, 2)
                << screen << ", frame " << frame
                << ": the cubes of a jack reach 3 % beyond its size, and nearer to the eye";
        }
    }
}

}  // namespace
}  // namespace tessera::simulation
