// A wall's `navigation`, as people write it and as hosts are told it.
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "common/codec/WallCodec.h"
#include "tests/support/words/Words.h"

namespace tessera {
namespace {

std::string wallWithNavigation(const std::string& navigation) {
    return "screens { name: \"front\" lower_left { x: -1 } lower_right { x: 1 } upper_left { x: -1 y: 1 }\n"
           "  grid { columns: 1 rows: 1 tile_width_px: 64 tile_height_px: 32 } }\n"
           "users { name: \"viewer\" position { y: 1.7 z: 2 } }\n"
           "hosts { name: \"all\" tiles { screen: \"front\" user: \"viewer\" } }\n" +
           navigation;
}

std::string errorOfNavigation(const std::string& navigation) {
    const Expected<Wall> wall = parseWall(wallWithNavigation(navigation), "try.wall");
    return wall ? "accepted" : wall.error().message;
}

TEST(NavigationWall, ReadsWhatIsThereAndHasDefaultsForTheRest) {
    const Expected<Wall> none = parseWall(wallWithNavigation(""), "try.wall");
    ASSERT_TRUE(none) << none.error().message;
    EXPECT_EQ(none->navigation, Navigation());
    const Expected<Wall> some =
        parseWall(wallWithNavigation("navigation { mode: WALK speed_m_s: 1.4 step_m: 0 }"), "try.wall");
    ASSERT_TRUE(some) << some.error().message;
    EXPECT_EQ(some->navigation, (Navigation{.mode = NavigationMode::kWalk, .speed = 1.4, .step = 0}));
}

TEST(NavigationWall, SaysWhatIsWrongAndWhere) {
    for (const char* wrong :
         {"speed_m_s: 0", "speed_m_s: -1", "speed_m_s: nan", "speed_m_s: inf", "faster: 0.5", "turn_deg_s: 1e9",
          "body_radius_m: 0", "body_radius_m: 250", "step_m: -0.1", "step_m: 400", "steepest_deg: 90"}) {
        const std::string error = errorOfNavigation(std::string("navigation { ") + wrong + " }");
        EXPECT_TRUE(error.starts_with("try.wall:5:1: ")) << error;
        EXPECT_WORDS(error);
    }
    EXPECT_WORDS(errorOfNavigation("navigation { mode: SWIM }"));
    EXPECT_WORDS(errorOfNavigation("navigation { speed: 2 }"));
    EXPECT_NE(errorOfNavigation("navigation { } navigation { }"), "accepted");
}

TEST(NavigationWall, ArrivesAsItWasSent) {
    Expected<Wall> wall = parseWall(wallWithNavigation(""), "try.wall");
    ASSERT_TRUE(wall);
    std::mt19937 random(11);
    const auto number = [&](double from, double to) { return std::uniform_real_distribution(from, to)(random); };
    for (int i = 0; i < 200; ++i) {
        wall->navigation = {.mode = static_cast<NavigationMode>(random() % 3),
                            .speed = number(0.001, 1000),
                            .fasterFactor = number(1, 100),
                            .turnDegrees = number(1, 720),
                            .bodyRadius = number(0.05, 1),
                            .step = number(0, 1),
                            .steepestDegrees = number(0, 80)};
        const Expected<Wall> there = decodeWall(encodeWall(*wall));
        ASSERT_TRUE(there) << there.error().message;
        ASSERT_EQ(there->navigation, wall->navigation);
    }
    wall->navigation.speed = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(decodeWall(encodeWall(*wall)));
}

}  // namespace
}  // namespace tessera
