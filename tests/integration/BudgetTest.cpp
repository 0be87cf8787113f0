/// A budget of milliseconds on walls whose drawing takes time: detail goes while they are late, on
/// all tiles alike, and comes back.
#include <gtest/gtest.h>

#include "common/image/Picture.h"
#include "tests/integration/ThreadWall.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

class BudgetWall : public ThreadWall {
public:
    explicit BudgetWall(const std::string& wall)
        : ThreadWall({.wall = wall,
                      .scene = std::string(TESSERA_SOURCE_DIR) + "/deploy/scenes/moving.tsct",
                      .size = "320x180"}) {
        for (const std::string& host : wall == "1x1" ? std::vector<std::string>{"all"} : kFourHosts) startClient(host);
        EXPECT_TRUE(waitForFrame("front-0-0", 2, 100s)) << logs();
    }
    json ask(std::vector<std::string> words) const {
        words.insert(words.begin(), "--json");
        const Outcome outcome = ctl(words);
        EXPECT_EQ(outcome.exitCode, 0) << outcome.output;
        return json::parse(outcome.output, nullptr, false);
    }
    /// All that moves stands at half a second.
    void stand() const {
        for (const char* node : {"/crawl", "/change", "/glow", "/swing"}) {
            (void)ask({"pause", node});
            (void)ask({"seek", node, "0.5"});
        }
    }
    /// Until the wall is at this step of detail, frame after frame.
    [[nodiscard]] bool reaches(unsigned step) const {
        for (int look = 0; look < 600; ++look) {
            if (ask({"budget"})["detail"] == step) return true;
            (void)waitForFrame("front-0-0", shownFrame("front-0-0") + 1, 10s);
        }
        return false;
    }
    [[nodiscard]] Picture picture() const {
        EXPECT_TRUE(waitForFrame("front-0-0", ask({"status"})["frame"].get<std::int64_t>() + 3, 60s)) << logs();
        const std::string path = folder() + "/seen.png";
        EXPECT_EQ(ctl({"snapshot", path}).exitCode, 0);
        const Expected<Bytes> bytes = readFile(path, 64 << 20);
        const auto png = bytes ? decodePng(*bytes) : Expected<DecodedPng>(tl::unexpected(bytes.error()));
        return png ? png->picture : Picture();
    }
};

TEST(Budget, DetailGoesInMotionAndComesBackAtRest) {
    Picture whole;
    {
        BudgetWall wall("1x1");
        wall.stand();
        whole = wall.picture();
        EXPECT_FALSE(wall.finish().is_null()) << wall.logs();
    }
    BudgetWall wall("2x2");
    EXPECT_EQ(wall.ask({"budget"})["budget_ms"], 0);
    (void)wall.ask({"budget", "0.1"});  // which no frame of it is drawn in
    EXPECT_TRUE(wall.reaches(6)) << wall.ask({"status"}).dump(2);
    wall.stand();
    // At rest all of it is drawn, whatever the budget; the bytes are those of a wall without one.
    EXPECT_TRUE(wall.reaches(0)) << wall.ask({"status"}).dump(2);
    EXPECT_TRUE(wall.picture() == whole);
    (void)wall.ask({"budget", "off"});
    const json report = wall.finish();
    ASSERT_FALSE(report.is_null()) << wall.logs();
    EXPECT_GT(report["detail"]["frames_at"][6], 0) << report["detail"].dump();
    EXPECT_GT(report["detail"]["changes"], 6);
    EXPECT_GT(report["detail"]["late"], 0);
    EXPECT_TRUE(report["faults"].empty()) << report["faults"].dump(2);
}

}  // namespace
}  // namespace tessera::test
