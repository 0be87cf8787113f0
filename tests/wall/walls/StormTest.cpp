/// Storms whose seeds stand here: `storm` looks for others (./deploy/run-tests --storm SECONDS).
#include <gtest/gtest.h>

#include <fmt/ranges.h>

#include "tests/support/wall/Storm.h"

namespace tessera::simulation {
namespace {

void expectNoLawBroken(const StormOptions& options, std::size_t count) {
    const std::vector<std::uint64_t> steps = Storm::stepsOf(options.seed, count);
    std::vector<std::string> said;
    const std::optional<Storm::Broken> broken =
        Storm::run(options, steps, [&](std::size_t, const Storm& storm) { said.push_back(storm.said()); });
    EXPECT_FALSE(broken) << "seed " << options.seed << ", step " << broken->step << ": " << broken->law
                         << "\n  build/bin/storm --scene " << options.scene << " --seed " << options.seed
                         << (options.draws ? "" : " --no-pictures") << (options.still ? " --still" : "") << " --steps "
                         << fmt::format("{}", fmt::join(steps.begin(),
                                                        steps.begin() + static_cast<std::ptrdiff_t>(said.size()), ","))
                         << "\n"
                         << fmt::format("{}", fmt::join(said, "\n"));
}

class StormSeeds : public testing::TestWithParam<std::uint64_t> {};

TEST_P(StormSeeds, BreakNoLaw) {
    const bool draws = GetParam() < 100;
    expectNoLawBroken(Storm::optionsOf(GetParam(), draws), draws ? 40 : 150);
}

INSTANTIATE_TEST_SUITE_P(OfWallsThatShowPictures, StormSeeds, testing::Values(1, 2));
INSTANTIATE_TEST_SUITE_P(OfWallsThatFollow, StormSeeds, testing::Range<std::uint64_t>(100, 110));

TEST(Storm, OfTheSameSeedIsTheSame) {
    const auto said = [] {
        std::vector<std::string> words;
        (void)Storm::run(Storm::optionsOf(7, false), Storm::stepsOf(7, 60),
                         [&](std::size_t, const Storm& storm) { words.push_back(storm.said()); });
        return words;
    };
    EXPECT_EQ(said(), said());
}

}  // namespace
}  // namespace tessera::simulation
