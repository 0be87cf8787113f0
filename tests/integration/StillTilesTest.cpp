/// What moves under a light with shadows is drawn by the tiles that see it or its shadow, and by no others.
#include <gtest/gtest.h>

#include <map>

#include "tests/integration/ThreadWall.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;

constexpr const char* kScene = R"(
material { name: "sand" base_color { r: 0.6 g: 0.5 b: 0.35 } roughness: 0.9 }
node { name: "sun" transform { rotation { axis { x: 1 } angle_deg: -80 } } directional_light { shadows: true } }
node { name: "floor" material: "sand" transform { translation { y: -0.1 z: -5 } } box { size { x: 12 y: 0.2 z: 10 } } }
node { name: "left post" transform { translation { x: -1.5 y: 1.5 z: -6 } } box { size { x: 0.3 y: 3 z: 0.3 } } }
node { name: "right post" transform { translation { x: 2 y: 1.5 z: -6 } } box { size { x: 0.3 y: 3 z: 0.3 } } }
node { name: "carriage" transform { translation { x: -3 y: 0.5 z: -4 } } box { size { x: 0.5 y: 0.3 z: 0.5 } } }
node {
  name: "drive"
  motion { target: "carriage" mode: LOOP
    key { time: 0 transform { translation { x: -3 y: 0.5 z: -4 } } }
    key { time: 1 transform { translation { x: -2.5 y: 0.5 z: -4 } } }
    key { time: 2 transform { translation { x: -3 y: 0.5 z: -4 } } } }
}
)";

TEST(StillTiles, DrawNothingWhereNeitherAThingNorItsShadowIsSeen) {
    constexpr std::uint64_t kFrames = 90;
    const TemporaryFolder folder;
    ThreadWall wall({.scene = folder.write("drive.tsct", kScene),
                     .size = "320x200",
                     .server = {"--plain", "--frames", std::to_string(kFrames)}});
    for (const std::string& host : kFourHosts) wall.startClient(host);
    const nlohmann::json report = wall.waitForEnd(120s);
    ASSERT_EQ(report["frames"], kFrames) << wall.logs();
    std::map<std::string, std::uint64_t> still;
    for (const auto& row : report["tiles"]) still[row["host"]] = row["still_frames"];
    EXPECT_LT(still.at("lower-left"), kFrames / 4) << report["tiles"].dump(2);
    for (const char* host : {"lower-right", "upper-left", "upper-right"})
        EXPECT_GT(still.at(host), kFrames - 10) << host << report["tiles"].dump(2);
}

}  // namespace
}  // namespace tessera::test
