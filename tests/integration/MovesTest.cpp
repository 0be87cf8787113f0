/// Several at once move the same thing by so much: everybody's way counts, and collisions have their say.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <memory>

#include "common/application/Application.h"
#include "common/cores/Transform.h"
#include "tests/integration/LiveWall.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

class Moves : public testing::Test {
protected:
    static constexpr int kTimes = 10;

    void SetUp() override {
        ASSERT_FALSE(wall_.address().empty()) << wall_.server().output();
        wall_.startClient("all");
        // The carriage drives for a second; then the yard stands still.
        ASSERT_TRUE(wall_.waitForFrame("front-0-0", 90, 60s)) << wall_.logs();
    }
    void TearDown() override {
        const json report = wall_.finish();
        ASSERT_FALSE(report.is_null()) << wall_.logs();
        EXPECT_TRUE(report["faults"].empty()) << report["faults"].dump(2);
        EXPECT_EQ(report["replication"]["state_hash_mismatches"], 0);
    }
    /// A shell that calls `tessera-ctl move NODE X Y Z --by` kTimes.
    Process shell(const std::string& node, const std::string& by) const {
        const std::string command =
            fmt::format("{} --server {} move '{}' {} --by", program("tessera-ctl"), wall_.address(), node, by);
        return {wall_.folder(),
                "shell",
                {"/bin/sh", "-c", fmt::format("for i in $(seq {}); do {} || exit 1; done", kTimes, command)}};
    }
    std::unique_ptr<Application> connect() const {
        auto application = Application::connect({.address = wall_.address(), .name = "test", .followScene = false});
        EXPECT_TRUE(application) << application.error().message;
        return application ? std::move(*application) : nullptr;
    }
    static Vec3d placeOf(Application& application, const std::string& name) {
        const auto node = application.describeNode(name);
        EXPECT_TRUE(node) << node.error().message;
        const auto there = application.fetch(std::span(&node->movable, 1));
        EXPECT_TRUE(there) << there.error().message;
        return there->coreOf(node->movable).as<Transform>()->translation;
    }
    LiveWall wall_{LiveWallOptions{.wall = "1x1"}};
};

TEST_F(Moves, OfFourShellsAtOnceAllCountAndEachCanBeTakenBack) {
    const auto application = connect();
    ASSERT_TRUE(application);
    const Vec3d before = placeOf(*application, "/row[0]");
    const std::uint64_t steps = application->status()->undoDepth;
    std::vector<Process> shells;
    for (int i = 0; i < 4; ++i) shells.push_back(shell("/row[0]", "1 0 0"));
    for (Process& one : shells) EXPECT_EQ(one.waitForExit(60s), 0) << one.output();
    EXPECT_EQ(placeOf(*application, "/row[0]"), before + Vec3d(4 * kTimes, 0, 0));
    EXPECT_EQ(application->status()->undoDepth, steps + 4 * kTimes);
    for (int i = 1; i <= 4 * kTimes; ++i) {
        ASSERT_TRUE(application->undo());
        ASSERT_EQ(placeOf(*application, "/row[0]"), before + Vec3d(4 * kTimes - i, 0, 0));
    }
}

TEST_F(Moves, OfFourApplicationsAtOnceTwoAreStoppedAndTheOthersAreNot) {
    const auto application = connect();
    ASSERT_TRUE(application);
    ASSERT_TRUE(application->moveNode("/carriage", {.translation = Vec3d(-4, 0.5, 0)}));
    const Vec3d before = placeOf(*application, "/row[1]");
    std::vector<Process> pushers, lifters;
    for (int i = 0; i < 2; ++i) {
        pushers.push_back(shell("/carriage", "1 0 0"));
        lifters.push_back(shell("/row[1]", "0 1 0"));
    }
    for (Process& one : pushers) {
        EXPECT_EQ(one.waitForExit(60s), 0) << one.output();
        EXPECT_NE(one.output().find("was stopped"), std::string::npos) << one.output();
        EXPECT_NE(one.output().find("/post"), std::string::npos) << "by what: " << one.output();
    }
    for (Process& one : lifters) {
        EXPECT_EQ(one.waitForExit(60s), 0) << one.output();
        EXPECT_EQ(one.output().find("stopped"), std::string::npos) << one.output();
    }
    EXPECT_EQ(placeOf(*application, "/row[1]"), before + Vec3d(0, 2 * kTimes, 0));
    const double x = placeOf(*application, "/carriage").x();  // its front at the post's face: 2 - 0.15 - 0.5
    EXPECT_LT(x, 1.35);
    EXPECT_GT(x, 1.3);
}

}  // namespace
}  // namespace tessera::test
