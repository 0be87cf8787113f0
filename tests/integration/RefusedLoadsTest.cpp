/// What loads that are refused leave in the server's memory.
#include <gtest/gtest.h>

#include <memory>

#include <fmt/format.h>

#include "tests/integration/LiveWall.h"
#include "tests/unit/Eventually.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;

/// 2^times spheres, in two kilobytes.
std::string doubled(int times, const std::string& more = {}) {
    std::string text = "definition { name: \"d0\" node { sphere { radius: 1 } } }\n";
    for (int i = 1; i <= times; ++i)
        text += fmt::format(
            "definition {{ name: \"d{0}\" node {{ instance: \"d{1}\" }} node {{ instance: \"d{1}\" }} }}\n", i, i - 1);
    return text + fmt::format("node {{ instance: \"d{}\" }}\n", times) + more;
}

class RefusedLoads : public testing::Test {
protected:
    /// The answers to several at once.
    std::vector<std::string> severalAreTold(const std::string& file) {
        std::vector<std::unique_ptr<Process>> asking;
        for (int i = 0; i < 4; ++i)
            asking.push_back(std::make_unique<Process>(
                folder_.path(), fmt::format("ctl{}", i),
                std::vector<std::string>{program("tessera-ctl"), "--server", wall_.address(), "load", file}));
        std::vector<std::string> told;
        for (const auto& one : asking) {
            EXPECT_EQ(one->waitForExit(90s), 3) << one->output();
            told.push_back(one->output());
        }
        return told;
    }
    /// Within 5 s of the last answer.
    [[nodiscard]] std::size_t leftBytes() {
        std::size_t left = 0;
        (void)eventually([&] { return (left = residentBytesOf(wall_.server().pid())) <= kMost; }, 5s);
        return left;
    }
    static constexpr std::size_t kMost = 300'000'000;
    TemporaryFolder folder_;
    LiveWall wall_{{.wall = "1x1", .server = {"--allow", folder_.path()}}};
};

TEST_F(RefusedLoads, OfDefinitionsThatMultiplyAreRefusedBeforeANodeIsMade) {
    ASSERT_FALSE(wall_.address().empty());
    for (const std::string& told : severalAreTold(folder_.write("doubled.tsct", doubled(24))))
        EXPECT_NE(told.find("more than 4000000 nodes"), std::string::npos) << told;
    EXPECT_LT(leftBytes(), kMost);
}

TEST_F(RefusedLoads, WhoseFaultIsFoundLastGiveBackWhatTheyTook) {
    ASSERT_FALSE(wall_.address().empty());
    const std::string late = doubled(17, "node { motion { target: \"nobody\" key { time: 0 } key { time: 1 } } }\n");
    for (const std::string& told : severalAreTold(folder_.write("late.tsct", late)))
        EXPECT_NE(told.find("nobody"), std::string::npos) << told;
    EXPECT_LT(leftBytes(), kMost);
}

}  // namespace
}  // namespace tessera::test
