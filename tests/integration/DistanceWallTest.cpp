/// The least distance drawn on a wall of real processes: the line joins what is nearest in every state, and goes when
/// nobody asks. What was done meanwhile, edits of control points among it, is made again from its recording.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/integration/AskedWall.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

const std::string kDistanceScene = std::string(TESSERA_SOURCE_DIR) + "/tests/data/scenes/distance.tsct";

Vec3d placeIn(const json& numbers) {
    return {numbers[0].get<double>(), numbers[1].get<double>(), numbers[2].get<double>()};
}

/// The transforms of a group of marks that can be seen.
std::vector<json> marksIn(const json& group) {
    std::vector<json> seen;
    for (const json& mark : group["children"])
        if (placeIn(mark["core"]["scale"]).prod() != 0) seen.push_back(mark["core"]);
    return seen;
}

/// Within rounding: a mark's far end is its place, its rotation and its length.
constexpr double kSamePlace = 1e-9;

class DistanceWall : public AskedWall {
public:
    DistanceWall(const std::string& wall, std::vector<std::string> server)
        : AskedWall({.wall = wall, .scene = kDistanceScene, .server = std::move(server)}), ready(start()) {}

    /// What is drawn is what is told; how far it is.
    double look(const std::string& what) const {
        SCOPED_TRACE(what);
        settle();
        const json told = ask({"contacts", "--distances"})["distances"];
        EXPECT_EQ(told.size(), 1u);
        if (told.size() != 1) return 0;
        const Vec3d from = placeIn(told[0]["points"][0]), to = placeIn(told[0]["points"][1]);
        const double distance = told[0]["distance"].get<double>();
        EXPECT_NEAR((to - from).norm(), distance, kSamePlace);
        const std::vector<json> lines = marksIn(ask({"tree", "/contacts/lines"})),
                                ends = marksIn(ask({"tree", "/contacts/points"}));
        if (distance == 0) {
            EXPECT_TRUE(lines.empty());
            EXPECT_EQ(ends.size(), 1u);
            return 0;
        }
        EXPECT_EQ(lines.size(), 1u);
        EXPECT_EQ(ends.size(), 2u);
        if (lines.size() != 1 || ends.size() != 2) return distance;
        const json& turn = lines[0]["rotation"];
        const Vec3d begin = placeIn(lines[0]["translation"]),
                    end = begin + Quatd(turn[0].get<double>(), turn[1].get<double>(), turn[2].get<double>(),
                                        turn[3].get<double>()) *
                                      Vec3d(0, 0, lines[0]["scale"][2].get<double>());
        EXPECT_LT((begin - from).norm(), kSamePlace);
        EXPECT_LT((end - to).norm(), kSamePlace);
        EXPECT_LT((placeIn(ends[0]["translation"]) - from).norm(), kSamePlace);
        EXPECT_LT((placeIn(ends[1]["translation"]) - to).norm(), kSamePlace);
        return distance;
    }
    /// The ball, and the control points of the cube's top, are led about.
    void play() const {
        EXPECT_NEAR(look("at the beginning"), 1, 1e-3);
        tell({"move", "/ball", "2", "0.3", "0.5"});
        EXPECT_NEAR(look("beside it"), 0.5, 1e-3);
        tell({"move", "/ball", "2.5", "2.5", "2"});
        const double far = look("beyond a corner");
        tell({"set", "/cube/skin", "points@5", "1.5", "1.6", "1.4"});
        EXPECT_LT(look("the corner was pulled towards it"), far - 0.5);
        tell({"move", "/ball", "0", "2.5", "0"});
        tell({"set", "/cube/skin", "points@4", "-1", "2", "1", "1", "2", "1", "1", "2", "-1", "-1", "2", "-1"});
        EXPECT_EQ(look("the top was raised into it"), 0);
        tell({"undo"});
        EXPECT_GT(look("and lowered"), 0.3);
    }
    const bool ready;
};

TEST(DistanceWall, TheLineJoinsWhatIsNearestAndGoesWhenNobodyAsks) {
    const TemporaryFolder folder;
    const std::string recording = folder.path() + "/distance.rec";
    std::string hash;
    Picture shown;
    {
        DistanceWall wall("2x2", {"--record", recording});
        ASSERT_TRUE(wall.ready) << wall.logs();
        wall.play();
        shown = wall.picture("shown");
        hash = wall.ask({"status"})["state_hash"];
        wall.tell({"contacts", "--show", "none"});
        wall.settle();
        EXPECT_EQ(wall.wall().ctl({"tree", "/contacts"}).exitCode, 3) << "nobody asks any more";
        EXPECT_GT(pixelsThatDiffer(shown, wall.picture("none")), 5u);
        wall.tell({"contacts", "--interest", "/gap", "--show", "normals"});
        wall.settle();
        EXPECT_EQ(marksIn(wall.ask({"tree", "/contacts/lines"})).size(), 1u);
        EXPECT_TRUE(marksIn(wall.ask({"tree", "/contacts/points"})).empty());
        EXPECT_EQ(wall.finish()["replication"]["state_hash_mismatches"], 0);
    }
    for (const char* threads : {"1", "4"}) {
        const Outcome replay =
            run(folder.path(), {program("tessera-replay"), recording, "--json", "--threads", threads}, 120s);
        EXPECT_EQ(replay.exitCode, 0) << replay.output;
        const json summary = json::parse(replay.output, nullptr, false);
        EXPECT_EQ(summary["result"], "same") << replay.output;
        EXPECT_EQ(summary["differing_frames"], 0);
    }
    DistanceWall one("1x1", {});
    ASSERT_TRUE(one.ready) << one.logs();
    one.play();
    EXPECT_EQ(one.ask({"status"})["state_hash"], hash) << "the marks are part of the scene";
    EXPECT_EQ(pixelsThatDiffer(one.picture("one"), shown), 0u);
    (void)one.finish();
}

/// Beside a running wall, control points are led, and at the end they are where they were.
TEST(DeformProgram, LeadsControlPointsAndBringsThemBack) {
    DistanceWall wall("1x1", {});
    ASSERT_TRUE(wall.ready) << wall.logs();
    EXPECT_NEAR(wall.look("at rest"), 1, 1e-3);
    const std::string server = wall.wall().address();
    const auto deform = [&](std::vector<std::string> words) {
        words.insert(words.begin(), {program("tessera-deform"), "--server", server});
        return run(wall.folder(), words, 120s);
    };
    {
        // As long as it runs. The cube's top sways, its foot stays.
        Process led(wall.folder(), "deform", {program("tessera-deform"), "--server", server, "bend-y:0..40:1:/cube"});
        bool sways = false;
        for (int frame = 0; frame < 100 && !sways; ++frame) {
            wall.settle();
            const json told = wall.ask({"contacts", "--distances"})["distances"];
            sways = told.size() == 1 && std::abs(told[0]["distance"].get<double>() - 1) > 0.05;
        }
        EXPECT_TRUE(sways) << led.output();
    }
    wall.tell({"undo"});
    EXPECT_NEAR(wall.look("one step of undo takes all of it back"), 1, 1e-3);

    const Outcome done = deform({"--seconds", "0.5", "twist-y:40:1:/cube", "bend-x:20:1:/cube"});
    EXPECT_EQ(done.exitCode, 0) << done.output;
    EXPECT_NEAR(wall.look("brought back"), 1, 1e-3);

    EXPECT_EQ(deform({"bend:20:1:/ball"}).exitCode, 3) << "a ball has no control points";
    EXPECT_EQ(deform({"fold:20:1:/cube"}).exitCode, 2);
    EXPECT_EQ(deform({"bend:20:1:/nobody"}).exitCode, 3);
    (void)wall.finish();
}

}  // namespace
}  // namespace tessera::test
