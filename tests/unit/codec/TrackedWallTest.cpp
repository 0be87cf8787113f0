/// Trackers, heads and wands in wall files: read, sent and read again; what is wrong, where and in words.
#include <gtest/gtest.h>

#include "common/codec/WallCodec.h"
#include "tests/support/words/Words.h"

namespace tessera {
namespace {

const char* const kTracked = R"(screens { name: "front"
  lower_left { x: -1.6 y: 0.6 z: 0 } lower_right { x: 1.6 y: 0.6 z: 0 } upper_left { x: -1.6 y: 2.4 z: 0 }
  grid { columns: 1 rows: 1 tile_width_px: 960 tile_height_px: 540 } }
users { name: "viewer" position { x: 0 y: 1.7 z: 2.4 }
  head { tracker: "art" sensor: 3 offset { position { y: -0.08 z: 0.02 } } } }
users { name: "guest" position { x: 1 y: 1.7 z: 2.4 } }
hosts { name: "all" tiles { screen: "front" user: "viewer" } }
trackers { name: "art" dtrack { listen: "0.0.0.0:5000" }
  frame { position { x: 0.1 y: 0.2 z: 0.3 } orientation { w: 0.5 x: 0.5 y: 0.5 z: 0.5 } }
  scale: 0.0011 axes: "x z -y" allow_from: "10.0.0.5" allow_from: "10.1.0.0/16"
  filter { jitter_mm: 0.7 jitter_degrees: 0.1 predict_ms: 40 jump_m: 0.3 hold_ms: 2000 ease_ms: 1000 } }
trackers { name: "phone" osc { listen: "[::]:9000" } filter { enabled: false } }
trackers { name: "lab" vrpn { url: "vrpn://lab.example:3884/Tracker0" buttons: "Button0" analogs: "Joystick0" } }
wands { name: "right" mount { tracker: "art" flystick: 1 offset { orientation { w: 0 y: 1 } } } }
wands { name: "left" mount { tracker: "lab" } }
wands { name: "pen" mount { tracker: "art" tool: 2 } }
wands { name: "ball" mount { tracker: "art" marker: 5 } }
)";

TEST(TrackedWall, ItsFileSaysTrackersHeadsAndWands) {
    const Expected<Wall> wall = parseWall(kTracked, "tracked.wall");
    ASSERT_TRUE(wall) << wall.error().message;
    const WallTracking& tracking = wall->tracking;
    ASSERT_EQ(tracking.trackers.size(), 3u);
    const WallTracker& art = tracking.trackers[0];
    EXPECT_EQ(art.protocol, TrackerProtocol::kDtrack);
    EXPECT_EQ(art.address, "0.0.0.0:5000");
    EXPECT_EQ(art.position, Vec3d(0.1, 0.2, 0.3));
    EXPECT_EQ(art.orientation.coeffs(), Quatd(0.5, 0.5, 0.5, 0.5).coeffs());
    EXPECT_EQ(art.metresPerOwnUnit(), 0.0011);
    EXPECT_EQ(art.axes, "x z -y");
    EXPECT_EQ(art.allowFrom, (std::vector<std::string>{"10.0.0.5", "10.1.0.0/16"}));
    EXPECT_EQ(art.filter.jitterMillimetres, 0.7);
    EXPECT_EQ(art.filter.jitterDegrees, 0.1);
    EXPECT_EQ(art.filter.longestPrediction.count(), 40);
    EXPECT_EQ(art.filter.jumpMetres, 0.3);
    EXPECT_EQ(art.filter.holdFor.count(), 2000);
    EXPECT_EQ(art.filter.easeFor.count(), 1000);
    EXPECT_TRUE(art.filter.enabled);
    EXPECT_EQ(tracking.trackers[1].protocol, TrackerProtocol::kOsc);
    EXPECT_EQ(tracking.trackers[1].metresPerOwnUnit(), 1);
    EXPECT_EQ(tracking.trackers[1].axes, "x y z");
    EXPECT_FALSE(tracking.trackers[1].filter.enabled);
    EXPECT_EQ(tracking.trackers[2].buttonDevice, "Button0");
    EXPECT_EQ(tracking.trackers[2].analogDevice, "Joystick0");
    ASSERT_EQ(tracking.heads.size(), 1u);
    EXPECT_EQ(tracking.heads[0].user, "viewer");
    EXPECT_EQ(toString(tracking.heads[0].mount.sensor), "body 3");
    EXPECT_EQ(tracking.heads[0].mount.offset, Vec3d(0, -0.08, 0.02));
    ASSERT_EQ(tracking.wands.size(), 4u);
    const char* const sensors[] = {"flystick 1", "body 0", "tool 2", "marker 5"};
    for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(toString(tracking.wands[i].mount.sensor), sensors[i]);
    EXPECT_EQ(tracking.wands[0].mount.turn.y(), 1);
}

TEST(TrackedWall, TravelsWhole) {
    const Wall wall = parseWall(kTracked, "tracked.wall").value();
    const Expected<Wall> back = decodeWall(encodeWall(wall));
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(encodeWall(*back), encodeWall(wall));
    ASSERT_EQ(back->tracking.trackers.size(), 3u);
    EXPECT_EQ(back->tracking.trackers[0].filter.jitterDegrees, 0.1);
    EXPECT_EQ(back->tracking.trackers[0].allowFrom, wall.tracking.trackers[0].allowFrom);
    EXPECT_EQ(back->tracking.trackers[2].address, "vrpn://lab.example:3884/Tracker0");
    EXPECT_EQ(back->tracking.heads[0].mount.offset, wall.tracking.heads[0].mount.offset);
    EXPECT_EQ(back->tracking.wands[0].mount.sensor, wall.tracking.wands[0].mount.sensor);
    EXPECT_EQ(back->tracking.wands[0].mount.turn.coeffs(), wall.tracking.wands[0].mount.turn.coeffs());
}

TEST(TrackedWall, SaysWhatIsWrongAndWhere) {
    struct Case {
        const char *from, *to, *place;
    };
    const Case cases[] = {
        {"tracker: \"art\" sensor: 3", "tracker: \"arr\" sensor: 3", ":4:"},
        {"sensor: 3", "sensor: -3", ":4:"},
        {"y: -0.08", "y: -80", ":4:"},
        {"w: 0 y: 1 }", "w: 0 }", ":14:"},
        {"name: \"left\" mount { tracker: \"lab\" }", "name: \"left\" mount { }", ":15:"},
        {"name: \"left\"", "name: \"right\"", ":15:"},
        {"listen: \"0.0.0.0:5000\"", "listen: \"0.0.0.0\"", ":8:"},
        {"listen: \"0.0.0.0:5000\"", "listen: \"0.0.0.0:70000\"", ":8:"},
        {"listen: \"0.0.0.0:5000\"", "listen: \"[::]:9000\"", ":12:"},
        {"listen: \"0.0.0.0:5000\"", "listen: \"0.0.0.0:9000\"", ":12:"},
        {"listen: \"0.0.0.0:5000\"", "listen: \"127.0.0.1:9000\"", ":12:"},
        {"dtrack { listen: \"0.0.0.0:5000\" }", "", ":8:"},
        {"axes: \"x z -y\"", "axes: \"x z z\"", ":8:"},
        {"scale: 0.0011", "scale: -1", ":8:"},
        {"w: 0.5 x: 0.5 y: 0.5 z: 0.5", "", ":8:"},
        {"w: 0.5 x: 0.5 y: 0.5 z: 0.5", "w: 1e308 x: 1e308", ":8:"},
        {"x: 0.1 y: 0.2", "x: 1000 y: 0.2", ":8:"},
        {"\"10.1.0.0/16\"", "\"gateway\"", ":8:"},
        {"jitter_mm: 0.7", "jitter_mm: nan", ":8:"},
        {"predict_ms: 40", "predict_ms: 999999999999", ":8:"},
        {"jump_m: 0.3", "jump_m: 0", ":8:"},
        {"hold_ms: 2000", "hold_ms: -1", ":8:"},
        {"hold_ms: 2000", "hold_ms: 9000000000000000000", ":8:"},
        {"vrpn://lab.example:3884/Tracker0", "vrpn://lab.example:3884", ":13:"},
        {"vrpn://lab.example:3884/Tracker0", "vrpn://lab.example:0/Tracker0", ":13:"},
        {"vrpn://lab.example:3884/Tracker0", "Tracker0@lab", ":13:"},
        {"name: \"phone\"", "name: \"art\"", ":12:"},
        {"name: \"phone\"", "name: \"my phone\"", ":12:"},
    };
    for (const Case& one : cases) {
        std::string text = kTracked;
        const std::size_t at = text.find(one.from);
        ASSERT_NE(at, std::string::npos) << one.from;
        text.replace(at, std::string(one.from).size(), one.to);
        const Expected<Wall> wall = parseWall(text, "tracked.wall");
        ASSERT_FALSE(wall) << one.to;
        EXPECT_EQ(wall.error().message.find(std::string("tracked.wall") + one.place), 0u)
            << one.to << ": " << wall.error().message;
        EXPECT_WORDS(wall.error().message);
    }
}

}  // namespace
}  // namespace tessera
