/// Several at once move the same thing by so much: everybody's way counts, and collisions have their say.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "tests/support/wall/AskedWall.h"

namespace tessera::simulation {
namespace {

class Moves : public testing::Test {
protected:
    static constexpr int kTimes = 10;
    struct RelativeMove {
        std::string node;
        Vec3d by;
    };

    void SetUp() override {
        // The carriage drives for a second; then the yard stands still.
        ASSERT_TRUE(wall_.waitForFrame(90)) << wall_.logs();
    }
    void TearDown() override { (void)wall_.finish(); }

    /// One application for each, which all move kTimes, all at the same time. How often each was stopped.
    template <std::size_t kCount>
    std::array<int, kCount> together(const std::array<RelativeMove, kCount>& moves) {
        std::array<int, kCount> stopped{};
        std::array<SimulatedApplication*, kCount> applications{};
        for (std::size_t i = 0; i < kCount; ++i) applications[i] = &wall_.application(fmt::format("mover{}", i));
        for (int time = 0; time < kTimes; ++time) {
            std::array<std::uint64_t, kCount> asked{};
            for (std::size_t i = 0; i < kCount; ++i) {
                request::MoveNode move;
                move.node = findNode(applications[i]->scene(), moves[i].node).value();
                move.move.translation = moves[i].by;
                move.move.relative = true;
                asked[i] = applications[i]->say(move);
            }
            for (std::size_t i = 0; i < kCount; ++i) {
                const auto told = applications[i]->await(asked[i], 20s);
                EXPECT_TRUE(told) << told.error().message;
                if (told) stopped[i] += std::get<answer::Committed>(*told).stopped.empty() ? 0 : 1;
            }
        }
        return stopped;
    }
    AskedWall wall_{{.wall = "1x1", .scene = kYard, .widthPx = 64, .heightPx = 36}};
};

TEST_F(Moves, OfFourApplicationsAtOnceAllCountAndEachCanBeTakenBack) {
    const Vec3d before = wall_.placeOf("/row[0]");
    const auto steps = wall_.ask({"status"})["undo_depth"].get<int>();
    const RelativeMove right{"/row[0]", Vec3d(1, 0, 0)};
    (void)together<4>({right, right, right, right});
    EXPECT_EQ(wall_.placeOf("/row[0]"), before + Vec3d(4 * kTimes, 0, 0));
    EXPECT_EQ(wall_.ask({"status"})["undo_depth"].get<int>(), steps + 4 * kTimes);
    for (int i = 1; i <= 4 * kTimes; ++i) {
        wall_.tell({"undo"});
        ASSERT_EQ(wall_.placeOf("/row[0]"), before + Vec3d(4 * kTimes - i, 0, 0));
    }
}

TEST_F(Moves, OfFourApplicationsAtOnceTwoAreStoppedAndTheOthersAreNot) {
    wall_.tell({"move", "/carriage", "-4", "0.5", "0"});
    const Vec3d before = wall_.placeOf("/row[1]");
    const RelativeMove push{"/carriage", Vec3d(1, 0, 0)}, lift{"/row[1]", Vec3d(0, 1, 0)};
    const std::array<int, 4> stopped = together<4>({push, lift, push, lift});
    EXPECT_GT(stopped[0], 0);
    EXPECT_GT(stopped[2], 0);
    EXPECT_EQ(stopped[1] + stopped[3], 0);
    EXPECT_EQ(wall_.placeOf("/row[1]"), before + Vec3d(0, 2 * kTimes, 0));
    const double x = wall_.placeOf("/carriage").x();  // its front at the post's face: 2 - 0.15 - 0.5
    EXPECT_LT(x, 1.35);
    EXPECT_GT(x, 1.3);
    const CommandOutcome told = wall_.ctl({"move", "/carriage", "1", "0", "0", "--by"});
    EXPECT_NE(told.output.find("was stopped"), std::string::npos) << told.output;
    EXPECT_NE(told.output.find("/post"), std::string::npos) << "by what: " << told.output;
}

}  // namespace
}  // namespace tessera::simulation
