/// The least distance drawn on a wall: the line joins what is nearest in each state looked at, and goes when
/// nobody asks. What was done meanwhile, edits of control points among it, is made again from its recording.
#include <gtest/gtest.h>

#include <cmath>

#include "server/tools/replay/ReplayCommand.h"
#include "tests/support/wall/AskedWall.h"

namespace tessera::simulation {
namespace {

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
        : AskedWall({.wall = wall, .scene = kDistanceScene, .server = std::move(server)}) {}

    /// What is drawn is what is told; how far it is.
    double look(const std::string& what) {
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
    void play() {
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
};

TEST(DistanceWall, TheLineJoinsWhatIsNearestAndGoesWhenNobodyAsks) {
    const test::TestFolder folder;
    const std::string recording = folder.path() + "/distance.rec";
    std::string hash;
    Picture shown;
    {
        DistanceWall wall("2x2", {"--record", recording});
        wall.play();
        shown = wall.settledPicture();
        hash = wall.ask({"status"})["state_hash"];
        wall.tell({"contacts", "--show", "none"});
        wall.settle();
        EXPECT_EQ(wall.ctl({"tree", "/contacts"}).exitCode, 3) << "nobody asks any more";
        EXPECT_GT(pixelsThatDiffer(shown, wall.settledPicture()), 5u);
        wall.tell({"contacts", "--interest", "/gap", "--show", "normals"});
        wall.settle();
        EXPECT_EQ(marksIn(wall.ask({"tree", "/contacts/lines"})).size(), 1u);
        EXPECT_TRUE(marksIn(wall.ask({"tree", "/contacts/points"})).empty());
        EXPECT_EQ(wall.finish()["replication"]["state_hash_mismatches"], 0);
    }
    for (const char* threads : {"1", "4"}) {
        const CommandOutcome replay = runHere([&] { return runReplay({recording, "--json", "--threads", threads}); });
        EXPECT_EQ(replay.exitCode, 0) << replay.output;
        const json summary = json::parse(replay.output, nullptr, false);
        EXPECT_EQ(summary["result"], "same") << replay.output;
        EXPECT_EQ(summary["differing_frames"], 0);
    }
    DistanceWall one("1x1", {});
    one.play();
    EXPECT_EQ(one.ask({"status"})["state_hash"], hash) << "the marks are part of the scene";
    EXPECT_EQ(pixelsThatDiffer(one.settledPicture(), shown), 0u);
    (void)one.finish();
}

}  // namespace
}  // namespace tessera::simulation
