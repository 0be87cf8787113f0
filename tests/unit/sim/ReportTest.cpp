// What report.json says of how far apart hosts showed a frame.
#include "server/sim/Report.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "server/sim/frame/FrameBudget.h"

namespace tessera {
namespace {

class SwapReport : public testing::Test {
protected:
    void shown(const std::string& host, std::uint64_t frame, double ms) {
        report_.shown({.host = host, .frame = FrameNumber(frame), .shownAtNs = static_cast<std::int64_t>(ms * 1e6)});
    }
    nlohmann::json sync() { return nlohmann::json::parse(report_.toJson(Aspect(), FrameBudget({})))["sync"]; }

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
    EXPECT_NEAR(sync()["swap_spread_ms"]["p50"].get<double>(), 1, 1e-9);
}

TEST_F(SwapReport, TakesNoSpreadFromAWordThatComesTooLate) {
    for (std::uint64_t frame = 0; frame < 3000; ++frame) shown("left", frame, static_cast<double>(frame));
    shown("right", 2, 5000);
    EXPECT_EQ(sync()["widest_swap"]["ms"], 0);
}

}  // namespace
}  // namespace tessera
