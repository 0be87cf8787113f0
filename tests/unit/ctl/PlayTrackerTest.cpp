/// What play-tracker sends is what the server's parsers read; what it is told in files and words.
#include "client/ctl/PlayTracker.h"

#include <gtest/gtest.h>

#include <fstream>

#include "server/sim/tracking/DtrackParser.h"
#include "server/sim/tracking/OscParser.h"
#include "tests/support/words/Words.h"
#include "tests/unit/TestFolder.h"

namespace tessera {
namespace {

std::string written(const test::TestFolder& folder, const std::string& text) {
    const std::string path = folder / "way.txt";
    std::ofstream(path) << text;
    return path;
}

TEST(PlayTracker, SendsWhatTheParsersRead) {
    for (int i = 0; i < 200; ++i) {
        PlayedPose pose = circlePose(0.037 * i);
        pose.orientation = Quatd(Eigen::AngleAxisd(0.1 * i, Vec3d(1, i % 7 - 3, 2).normalized()));
        const auto dtrack = parseDtrack(dtrackDatagram(static_cast<std::uint64_t>(i), 3, false, 0, pose));
        const auto stick = parseDtrack(dtrackDatagram(static_cast<std::uint64_t>(i), 4, true, 5, pose));
        const auto osc = parseOsc(oscDatagram(5, pose));
        ASSERT_TRUE(dtrack && stick && osc);
        ASSERT_EQ(dtrack->size() + stick->size() + osc->size(), 3u);
        EXPECT_EQ(toString(dtrack->front().sensor) + toString(stick->front().sensor) + toString(osc->front().sensor),
                  "body 3flystick 4body 5");
        EXPECT_EQ(stick->front().buttons, 5u);
        EXPECT_EQ(stick->front().buttonsSaid, 0xffu);
        for (const RawPose& read : {*dtrack->front().pose, *stick->front().pose}) {
            EXPECT_LT((read.position - 1000 * pose.position).norm(), 0.002);
            EXPECT_LT(read.orientation.angularDistance(pose.orientation), 1e-5);
        }
        EXPECT_LT((osc->front().pose->position - pose.position).norm(), 1e-6);
        EXPECT_LT(osc->front().pose->orientation.angularDistance(pose.orientation), 1e-5);
    }
}

TEST(PlayTracker, GoesThroughAFileAndBeginsItAgain) {
    const test::TestFolder folder;
    const std::string path = written(folder, "# time and place\n1 0 0 0\n\n2 1 0 0   # a metre on\n3 1 2 0  0 0 1 0\n");
    const auto poses = readTrackerPoses(path);
    ASSERT_TRUE(poses) << poses.error().message;
    EXPECT_EQ(poseAt(*poses, 0).position, Vec3d(0, 0, 0));
    EXPECT_EQ(poseAt(*poses, 0.25).position, Vec3d(0.25, 0, 0));
    EXPECT_EQ(poseAt(*poses, 1.5).position, Vec3d(1, 1, 0));
    EXPECT_NEAR(poseAt(*poses, 1.5).orientation.angularDistance(Quatd::Identity()), EIGEN_PI / 2, 1e-9);
    EXPECT_EQ(poseAt(*poses, 2.25).position, Vec3d(0.25, 0, 0));
    const auto one = readTrackerPoses(written(folder,
                                              "\xEF\xBB\xBF"
                                              "5 1 2 3"));  // as some editors begin
    ASSERT_TRUE(one);
    EXPECT_EQ(poseAt(*one, 77).position, Vec3d(1, 2, 3));
}

TEST(PlayTracker, RefusesFilesThatSayNoPosesWithTheLine) {
    const test::TestFolder folder;
    for (const char* text :
         {"", "1 2 3\n", "0 0 0 0\n0 0 0 0\n", "0 0 0 x\n", "0 0 0 0 0 0 0 0\n", "0 0 0 0 1e308 1e308 0 0\n"}) {
        const auto poses = readTrackerPoses(written(folder, text));
        ASSERT_FALSE(poses) << text;
        EXPECT_EQ(poses.error().code, ErrorCode::kBadInput);
        EXPECT_WORDS(poses.error().message);
    }
    EXPECT_EQ(readTrackerPoses("/nowhere/way.txt").error().code, ErrorCode::kNotFound);
    EXPECT_EQ(play({.to = "nowhere"}).error().code, ErrorCode::kUsage);
    for (const std::string port : {"0", "-1", "65536", "70000", "http", "5000x"})
        EXPECT_EQ(play({.to = "127.0.0.1:" + port}).error().code, ErrorCode::kUsage) << port;
}

TEST(PlayTracker, NeedsNoServer) {
    const auto parsed =
        parseCommandLine({"play-tracker", "127.0.0.1:5000", "--protocol", "osc", "--rate", "120", "--sensor", "2"});
    ASSERT_TRUE(parsed) << parsed.error().message;
    const auto& wish = std::get<verb::PlayTracker>(std::get<CommandLine>(*parsed).verb);
    EXPECT_TRUE(wish.osc && wish.rateHz == 120 && wish.sensor == 2 && wish.file.empty());
    EXPECT_FALSE(parseCommandLine({"play-tracker", "127.0.0.1:5000", "--protocol", "osc", "--flystick"}));
    EXPECT_FALSE(parseCommandLine({"play-tracker"}));
}

}  // namespace
}  // namespace tessera
