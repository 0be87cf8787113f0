// What report.json says of how far apart hosts showed a frame.
#include "server/sim/report/Report.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <random>

#include <nlohmann/json.hpp>

#include "server/sim/report/ReportFile.h"
#include "server/sim/view/FrameBudget.h"
#include "tests/property/Seeds.h"
#include "tests/support/words/Words.h"
#include "tests/unit/TestFolder.h"

namespace tessera {
namespace {

class SwapReport : public testing::Test {
protected:
    void shown(const std::string& host, std::uint64_t frame, double ms) {
        report_.shown({.host = host, .frame = FrameNumber(frame), .shownAtNs = static_cast<std::int64_t>(ms * 1e6)});
    }
    nlohmann::json sync() {
        return nlohmann::json::parse(report_.toJson(Aspect(), FrameBudget({}), ExposureMeter({})))["sync"];
    }

    Report report_{Wall(), "scene"};
};

TEST_F(SwapReport, NamesTheFrameThatWasShownFarthestApart) {
    for (std::uint64_t frame = 0; frame < 50; ++frame) {
        shown("left", frame, 16.0 * static_cast<double>(frame));
        shown("right", frame, 16.0 * static_cast<double>(frame) + (frame == 20 ? 7 : 1));
    }
    EXPECT_EQ(sync()["widest_swap"]["frame"], 20);
    EXPECT_EQ(sync()["widest_swap"]["last"], "right");
    EXPECT_NEAR(sync()["widest_swap"]["ms"].get<double>(), 7, 1e-9);
}

/// Under hold the others go on meanwhile.
TEST_F(SwapReport, WaitsForAHostThatShowsAFrameManyFramesLater) {
    for (std::uint64_t frame = 0; frame < 300; ++frame) {
        shown("left", frame, 16.0 * static_cast<double>(frame));
        if (frame != 20) shown("right", frame, 16.0 * static_cast<double>(frame) + 1);
    }
    shown("right", 20, 16.0 * 300);
    EXPECT_EQ(sync()["widest_swap"]["frame"], 20);
    EXPECT_NEAR(sync()["widest_swap"]["ms"].get<double>(), 16.0 * 280, 1e-6);
    EXPECT_NEAR(sync()["swap_spread_ms"]["p50"].get<double>(), 1, 0.01) << "p50 is told within 1 %";
}

TEST_F(SwapReport, TakesNoSpreadFromAWordThatComesTooLate) {
    for (std::uint64_t frame = 0; frame < 3000; ++frame) shown("left", frame, static_cast<double>(frame));
    shown("right", 2, 5000);
    EXPECT_EQ(sync()["widest_swap"]["ms"], 0);
}

/// Beside all numbers, sorted.
void expectAsSorted(std::vector<double> numbers, const std::string& which) {
    Series series;
    for (const double number : numbers) series.add(number);
    std::ranges::sort(numbers);
    for (const double share : {0.001, 0.01, 0.25, 0.5, 0.9, 0.99, 0.999}) {
        const double truth =
            numbers[static_cast<std::size_t>(std::ceil(share * static_cast<double>(numbers.size()))) - 1];
        EXPECT_NEAR(series.quantile(share), truth, 0.01 * truth) << which << ", " << share;
    }
    EXPECT_EQ(series.quantile(1), numbers.back()) << which;
    EXPECT_EQ(series.count(), numbers.size());
}

// A rename onto /dev/null would be the last of it.
TEST(ReportFile, TakesThePlaceOfFilesAlone) {
    const test::TestFolder folder;
    ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
    const Expected<void> written = writeReport(folder / "pipe", "{}");
    ASSERT_FALSE(written);
    EXPECT_WORDS(written.error().message);
    EXPECT_TRUE(std::filesystem::is_fifo(folder / "pipe"));
    EXPECT_TRUE(writeReport(folder / "report.json", "{}"));
    EXPECT_TRUE(writeReport(folder / "report.json", "{}")) << "once more";
}

TEST(Series, TellsQuantilesOfAnyDistributionWithinAHundredth) {
    forSeeds(20, [](Random& random) {
        const auto count = std::uniform_int_distribution<std::size_t>(1, 20'000)(random);
        std::vector<double> even, normal, exponential, wide, steps, twoHeaps;
        const double scale = std::pow(10, std::uniform_real_distribution(-2.0, 7.0)(random));
        for (std::size_t i = 0; i < count; ++i) {
            even.push_back(scale * std::uniform_real_distribution(0.1, 1.0)(random));
            normal.push_back(scale * std::lognormal_distribution(0.0, 0.1)(random));
            exponential.push_back(scale * (1e-3 + std::exponential_distribution(1.0)(random)));
            wide.push_back(std::pow(10, std::uniform_real_distribution(-5.0, 8.0)(random)));
            steps.push_back(std::ldexp(1.0, std::uniform_int_distribution(-10, 20)(random)));
            twoHeaps.push_back((i % 70 == 0 ? 250.0 : 16.6) * std::uniform_real_distribution(0.95, 1.05)(random));
        }
        expectAsSorted(even, "even");
        expectAsSorted(normal, "log-normal");
        expectAsSorted(exponential, "exponential");
        expectAsSorted(wide, "over thirteen decades");
        expectAsSorted(steps, "powers of two");
        expectAsSorted(twoHeaps, "two heaps");
    });
}

TEST(Series, TakesWhateverHostsSay) {
    Series series;
    EXPECT_EQ(series.quantile(0.5), 0);
    for (const double number : {std::nan(""), -5.0, 0.0, 1e-300, -std::numeric_limits<double>::infinity()})
        series.add(number);
    EXPECT_EQ(series.quantile(0.5), 0);
    EXPECT_EQ(series.quantile(1), 0);
    series.add(1e300);
    EXPECT_EQ(series.quantile(1), 1e300);
    for (int i = 0; i < 10; ++i) series.add(std::numeric_limits<double>::infinity());
    EXPECT_GE(series.quantile(0.8), 1e9);
    EXPECT_EQ(series.count(), 16u);
}

TEST(Series, GoesOnInTheSameMemory) {
    Series series;
    const std::size_t memory = series.memory();
    for (int i = 0; i < 3'000'000; ++i) series.add(i < 1'000'000 ? 1 : 3);
    EXPECT_NEAR(series.quantile(0.5), 3, 0.03);
    EXPECT_EQ(series.memory(), memory);
    EXPECT_LE(memory, 32u * 1024);
}

TEST(Report, GoesOnMeasuringAfterAMillionFrames) {
    Report report(Wall(), "scene");
    server_action::FrameReleased released{.shown = {"only"}};
    for (int i = 0; i < 3'000'000; ++i) {
        released.frameTime = i < 1'000'000 ? std::chrono::milliseconds(1) : std::chrono::milliseconds(3);
        report.released(released);
    }
    const nlohmann::json said = nlohmann::json::parse(report.toJson(Aspect(), FrameBudget({}), ExposureMeter({})));
    EXPECT_EQ(said["frames"], 3'000'000);
    EXPECT_NEAR(said["frame_ms"]["p50"].get<double>(), 3, 0.03);
    EXPECT_EQ(said["frame_ms"]["max"], 3);
}

}  // namespace
}  // namespace tessera
