#include "server/tools/PoseFile.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/words/Words.h"
#include "tests/unit/TestFolder.h"

namespace tessera {
namespace {

std::vector<PoseLine> parsed(std::string_view text) {
    const auto poses = parsePoses(text, "p");
    EXPECT_TRUE(poses) << poses.error().message;
    return poses ? *poses : std::vector<PoseLine>{};
}

std::string refusal(std::string_view text) {
    const auto poses = parsePoses(text, "some.poses");
    if (poses) return "accepted";
    EXPECT_EQ(poses.error().code, ErrorCode::kBadInput);
    return poses.error().message;
}

TEST(PoseFile, ReadsAPosePerLine) {
    const auto poses = parsed("1 2 3 1 0 0 0\n-1e-3 +2.5 .5 0 0 1 0\n");
    ASSERT_EQ(poses.size(), 2u);
    EXPECT_EQ(poses[0].start.translation, Vec3d(1, 2, 3));
    EXPECT_EQ(poses[1].start.translation, Vec3d(-1e-3, 2.5, 0.5));
    EXPECT_EQ(poses[1].start.rotation.y(), 1);
    EXPECT_EQ(poses[1].start.scale, Vec3d::Ones());
    EXPECT_FALSE(poses[0].end);
}

TEST(PoseFile, ReadsTheScalarOfAQuaternionFirst) {
    // A quarter turn about x takes y to z.
    const auto poses = parsed("0 0 0 1 1 0 0");
    ASSERT_EQ(poses.size(), 1u);
    EXPECT_LT((poses[0].start.matrix() * Vec3d::UnitY() - Vec3d::UnitZ()).norm(), 1e-15);
}

TEST(PoseFile, ReadsAMotionFromFourteenNumbers) {
    const auto poses = parsed("0 0 0 1 0 0 0  4 5 6 0 0 0 -2");
    ASSERT_EQ(poses.size(), 1u);
    ASSERT_TRUE(poses[0].end);
    EXPECT_EQ(poses[0].end->translation, Vec3d(4, 5, 6));
    EXPECT_EQ(poses[0].end->rotation.z(), -1);
}

TEST(PoseFile, SkipsCommentsAndEmptyLinesButCountsThem) {
    const auto poses = parsed("# tx ty tz qw qx qy qz\n\n  \t\n0 0 0 1 0 0 0 # at rest\r\n#\n1 0 0 1 0 0 0");
    ASSERT_EQ(poses.size(), 2u);
    EXPECT_EQ(poses[0].line, 4u);
    EXPECT_EQ(poses[1].line, 6u);
}

TEST(PoseFile, OfNothingIsEmpty) {
    EXPECT_TRUE(parsed("").empty());
    EXPECT_TRUE(parsed("# nothing\n").empty());
}

TEST(PoseFile, NormalisesQuaternionsOfAnyLength) {
    for (const char* q : {"1 1 1 1", "1e-300 1e-300 1e-300 1e-300", "1e300 1e300 1e300 1e300", "5e-324 0 0 0"}) {
        const auto poses = parsed("0 0 0 " + std::string(q));
        ASSERT_EQ(poses.size(), 1u) << q;
        EXPECT_NEAR(poses[0].start.rotation.norm(), 1, 1e-15) << q;
    }
}

TEST(PoseFile, SaysWhichLineHasTheWrongCount) {
    EXPECT_EQ(refusal("0 0 0 1 0 0 0\n\n1 2 3\n"),
              "some.poses:3: 3 numbers; a pose has 7 (tx ty tz qw qx qy qz), a motion 14 (start and end)");
    EXPECT_WORDS(refusal("0 0 0 1 0 0 0 0\n"));
    EXPECT_WORDS(refusal("1\n"));
    EXPECT_WORDS(refusal("1 1 1 1 1 1 1 1 1 1 1 1 1 1 1 1\n"));
}

TEST(PoseFile, SaysWhichWordIsNoNumber) {
    EXPECT_EQ(refusal("0 0 0 1 0 0 0\n0 0 zero 1 0 0 0"), "some.poses:2: 'zero' is not a number");
    EXPECT_EQ(refusal("0 0 0, 1 0 0 0"), "some.poses:1: '0,' is not a number");
    EXPECT_EQ(refusal("0 0 0x10 1 0 0 0"), "some.poses:1: '0x10' is not a number");
    EXPECT_EQ(refusal("0 0 +-1 1 0 0 0"), "some.poses:1: '+-1' is not a number");
}

TEST(PoseFile, RefusesWhatIsNotFinite) {
    EXPECT_EQ(refusal("0 0 nan 1 0 0 0"), "some.poses:1: 'nan' is not finite");
    EXPECT_EQ(refusal("0 -inf 0 1 0 0 0"), "some.poses:1: '-inf' is not finite");
    EXPECT_EQ(refusal("0 1e999 0 1 0 0 0"), "some.poses:1: '1e999' is beyond the range of double");
    EXPECT_WORDS(refusal("0 1e200 0 1 0 0 0"));
}

TEST(PoseFile, RefusesAQuaternionWithoutLength) {
    EXPECT_EQ(refusal("0 0 0 0 0 0 0"), "some.poses:1: the quaternion has no length");
    EXPECT_EQ(refusal("0 0 0 1 0 0 0 1 1 1 0 -0 0 0"), "some.poses:1: the quaternion at the end has no length");
}

TEST(PoseFile, OfBinaryRubbishIsOneMessage) {
    std::string rubbish;
    for (int i = 0; i < 4096; ++i) rubbish += static_cast<char>(i * 37 % 251 + 1);
    EXPECT_NE(refusal(rubbish), "accepted");
}

TEST(PoseFile, ThatIsMissingOrAFolderSaysSo) {
    test::TestFolder folder;
    const auto missing = readPoses(folder / "none.poses");
    ASSERT_FALSE(missing);
    EXPECT_EQ(missing.error().code, ErrorCode::kNotFound);
    EXPECT_WORDS(missing.error().message);
    const auto aFolder = readPoses(folder.path());
    ASSERT_FALSE(aFolder);
    EXPECT_EQ(aFolder.error().code, ErrorCode::kBadInput);
}

TEST(PoseFile, ReadsARayPerLine) {
    const auto rays = parseRays("# origin, direction\n1 2 3 0 0 -2\n\n-.5 0 0 1e-3 0 0  # along x\n", "r");
    ASSERT_TRUE(rays) << rays.error().message;
    ASSERT_EQ(rays->size(), 2u);
    EXPECT_EQ((*rays)[0].ray.origin, Vec3d(1, 2, 3));
    EXPECT_EQ((*rays)[0].ray.direction, Vec3d(0, 0, -2));
    EXPECT_EQ((*rays)[1].line, 4u);
    for (const auto& [text, words] : {std::pair("1 2 3", "r:1: 3 numbers; a ray has 6: ox oy oz dx dy dz"),
                                      std::pair("0 0 0 0 0 0", "r:1: the ray has no direction"),
                                      std::pair("\n0 0 0 1 0 inf", "r:2: 'inf' is not finite"),
                                      std::pair("0 0 0 1 0 x", "r:1: 'x' is not a number")}) {
        const auto refused = parseRays(text, "r");
        ASSERT_FALSE(refused) << text;
        EXPECT_EQ(refused.error().message, words);
    }
}

}  // namespace
}  // namespace tessera
