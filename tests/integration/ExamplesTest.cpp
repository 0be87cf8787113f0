/// The examples do what they say, on a real wall.
#include <gtest/gtest.h>

#include "common/base/Error.h"
#include "common/math/Types.h"
#include "tests/integration/LiveWall.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;

/// Started, with all hosts of a shipped wall.
class ExampleWall : public LiveWall {
public:
    explicit ExampleWall(const std::string& wall)
        : LiveWall(
              {.wall = wall, .scene = std::string(TESSERA_SOURCE_DIR) + "/deploy/examples/carousel/carousel.tsct"}) {
        for (const std::string& host : wall == "1x1" ? std::vector<std::string>{"all"} : kFourHosts) startClient(host);
        EXPECT_TRUE(waitForFrame("front-0-0", 2, 100s)) << logs();
    }
    [[nodiscard]] Vec3d placeOf(const std::string& node) const {
        const nlohmann::json told = nlohmann::json::parse(ctl({"--json", "tree", node}).output, nullptr, false);
        if (!told.is_object()) return Vec3d::Zero();
        const nlohmann::json& at = told["core"]["translation"];
        return {at[0].get<double>(), at[1].get<double>(), at[2].get<double>()};
    }
};

const std::string kMover = std::string(TESSERA_BIN_DIR) + "/example-mover";
const std::string kProgram = std::string(TESSERA_BIN_DIR) + "/example-carousel";

TEST(Examples, TheCarouselTurnsAboutWhereItTouches) {
    const TemporaryFolder folder;
    ExampleWall wall("2x2");
    Process ride(folder.path(), "carousel", {kProgram, wall.address(), "/fair/hub", "0.75"});
    // A quarter on, red would stand where the post is.
    ASSERT_TRUE(ride.waitForText("/fair/hub touches /fair/post", 60s)) << ride.output();
    ASSERT_TRUE(ride.waitForText("/fair/hub leaves /fair/post", 60s)) << ride.output();
    EXPECT_EQ(wall.ctl({"remove", "/fair/hub/blue"}).exitCode, 0);
    ASSERT_TRUE(ride.waitForText("is gone after", 60s)) << ride.output();
    EXPECT_EQ(ride.waitForExit(120s).value_or(-1), 0) << ride.output();
    // It rode on a circle: the radius is what it was.
    const Vec3d red = wall.placeOf("/fair/hub/red");
    EXPECT_NEAR(red.norm(), 2, 1e-9);
    const nlohmann::json report = wall.finish();
    ASSERT_FALSE(report.is_null()) << wall.logs();
    EXPECT_EQ(report["replication"]["state_hash_mismatches"], 0);
    EXPECT_TRUE(report["faults"].empty()) << report["faults"].dump(2);
}

TEST(Examples, TheMoverMovesByEitherClock) {
    const TemporaryFolder folder;
    ExampleWall wall("1x1");
    const Vec3d before = wall.placeOf("/fair/hub/red");
    const Outcome paced = run(folder.path(), {kMover, wall.address(), "/fair/hub/red", "paced", "10"}, 60s);
    EXPECT_EQ(paced.exitCode, 0) << paced.output;
    EXPECT_NE(paced.output.find("moved /fair/hub/red 10 times, paced"), std::string::npos) << paced.output;
    const Outcome queued = run(folder.path(), {kMover, wall.address(), "/fair/hub/red", "queued", "10"}, 60s);
    EXPECT_EQ(queued.exitCode, 0) << queued.output;
    EXPECT_NE(queued.output.find(" times, queued"), std::string::npos) << queued.output;
    EXPECT_EQ(wall.placeOf("/fair/hub/red"), before) << "it leaves the wall as it was";
    const Outcome lost = run(folder.path(), {kMover, wall.address(), "/fair/wheel", "paced", "1"}, 30s);
    EXPECT_EQ(lost.exitCode, exitCode(ErrorCode::kNotFound)) << lost.output;
    EXPECT_FALSE(wall.finish().is_null()) << wall.logs();
}

TEST(Examples, SaysWhatIsWrong) {
    const TemporaryFolder folder;
    EXPECT_EQ(run(folder.path(), {kProgram}, 30s).exitCode, exitCode(ErrorCode::kUsage));
    ExampleWall wall("1x1");
    const Outcome lost = run(folder.path(), {kProgram, wall.address(), "/fair/wheel"}, 30s);
    EXPECT_NE(lost.exitCode, 0);
    EXPECT_NE(lost.output.find("wheel"), std::string::npos) << lost.output;
    EXPECT_FALSE(wall.finish().is_null()) << wall.logs();
}

}  // namespace
}  // namespace tessera::test
