/// Which tile the wall waited for, and why: sessions on times of the tests' own.
#include "server/sim/report/WaitStatistics.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <numeric>
#include <random>

#include "tests/unit/session/ServerFixture.h"

namespace tessera {
namespace {

/// Host "a" has one tile, "b" two beside it.
Wall wallOfThree() {
    Wall wall;
    wall.name = "three";
    Screen screen;
    screen.name = "front";
    screen.grid = {.columns = 3, .rows = 1, .tileWidthPx = 64, .tileHeightPx = 48};
    wall.screens = {screen};
    wall.users = {User{.name = "viewer"}};
    for (const char* host : {"a", "b"}) wall.hosts.push_back({.name = host, .tiles = {}});
    for (int column = 0; column < 3; ++column)
        wall.hosts[column == 0 ? 0 : 1].tiles.push_back(
            {.screen = "front", .column = column, .row = 0, .user = "viewer"});
    return wall;
}

/// Two hosts in a session, whose actions go where the frame loop takes them.
struct WaitingWall : ServerFixture {
    WaitingWall() {
        a = join("a");
        b = join("b");
        forget();
    }
    /// Both take as long as `times` say from Begin on, and say that their time went to `stats`.
    void frame(Duration aTakes, const HostStats& aStats, Duration bTakes, const HostStats& bStats) {
        const FrameNumber number = begin(commit());
        const TimePoint begun = now;
        const auto answer = [&](ConnectionId host, Duration after, const HostStats& stats) {
            now = begun + after;
            say(host, message::Ready{number, hashAfter(sequence), share(encodeStats(stats))});
        };
        if (aTakes <= bTakes) answer(a, aTakes, aStats);
        answer(b, bTakes, bStats);
        if (aTakes > bTakes) answer(a, aTakes, aStats);
        collect();
    }
    void collect() {
        for (const ServerAction& action : done) {
            if (const auto* stats = std::get_if<server_action::FrameStats>(&action))
                waits.ready(stats->host, stats->frame, decodeStats(stats->stats).value());
            if (const auto* released = std::get_if<server_action::FrameReleased>(&action)) waits.released(*released);
        }
        forget();
    }

    WaitStatistics waits{wallOfThree()};
    ConnectionId a, b;
};

HostStats drawing(std::vector<TileStats> tiles, double workMs) {
    return {.tiles = std::move(tiles), .workMs = workMs};
}
const std::vector<TileStats> kQuick = {{.tile = "front-0-0", .cullMs = 1, .drawMs = 8}};
double part(const WaitStatistics::Row& row, WaitReason reason) {
    return row.why[static_cast<std::size_t>(reason)];
}

TEST(WaitStatistics, NamesTheTileThatDrawsLongest) {
    WaitingWall wall;
    for (int i = 0; i < 3; ++i)
        wall.frame(
            10ms, drawing(kQuick, 9), 30ms,
            drawing({{.tile = "front-1-0", .cullMs = 1, .drawMs = 6}, {.tile = "front-2-0", .cullMs = 2, .drawMs = 20}},
                    29));
    const auto rows = wall.waits.all();
    ASSERT_EQ(rows.size(), 1u);
    EXPECT_EQ(rows[0].tile, "front-2-0");
    EXPECT_EQ(rows[0].host, "b");
    EXPECT_EQ(rows[0].frames, 3u);
    EXPECT_NEAR(rows[0].ms, 60, 1e-9);
    EXPECT_NEAR(rows[0].longestMs, 20, 1e-9);
    EXPECT_EQ(rows[0].reason(), WaitReason::kDraw);
    EXPECT_NEAR(part(rows[0], WaitReason::kDraw), 3 * (26 - 8), 1e-9);
    EXPECT_NEAR(part(rows[0], WaitReason::kCull), 3 * (3 - 1), 1e-9);
    EXPECT_NEAR(part(rows[0], WaitReason::kNetwork), 0, 1e-9);
}

TEST(WaitStatistics, TellsLateListsFromProcessorsSleepAndTheNetwork) {
    const HostStats quick = drawing(kQuick, 9);
    const auto reasonOf = [&](const HostStats& slow) {
        WaitingWall wall;
        wall.frame(50ms, slow, 10ms, quick);
        const auto rows = wall.waits.all();
        EXPECT_EQ(rows.size(), 1u);
        EXPECT_NEAR(rows.at(0).ms, 40, 1e-9);
        return std::string(nameOf(rows.at(0).reason()));
    };
    EXPECT_EQ(reasonOf({.tiles = kQuick, .workMs = 49, .applyMs = 40}), "apply");
    EXPECT_EQ(reasonOf({.tiles = kQuick, .workMs = 49, .applyMs = 40, .applyQueuedMs = 38}), "processor");
    EXPECT_EQ(reasonOf(drawing({{.tile = "front-0-0", .cullMs = 41, .drawMs = 8}}, 49)), "cull");
    EXPECT_EQ(reasonOf(drawing({{.tile = "front-0-0", .cullMs = 1, .drawMs = 48}}, 49)), "draw");
    EXPECT_EQ(reasonOf(drawing({{.tile = "front-0-0", .cullMs = 1, .drawMs = 48, .drawQueuedMs = 39}}, 49)),
              "processor");
    EXPECT_EQ(reasonOf(drawing({{.tile = "front-0-0", .cullMs = 1, .drawMs = 8, .handOverMs = 40}}, 49)), "hand_over");
    EXPECT_EQ(reasonOf(drawing(kQuick, 49)), "stood_still");
    EXPECT_EQ(reasonOf(quick), "network");
}

TEST(WaitStatistics, OfAHostThatIsGoneNobodyKnowsWhy) {
    WaitingWall wall;
    const FrameNumber frame = wall.begin(wall.commit());
    wall.pass(10ms);
    wall.ready(wall.a, frame);
    wall.pass(25ms);
    wall.drop(wall.b);
    wall.collect();
    const auto rows = wall.waits.all();
    ASSERT_EQ(rows.size(), 1u);
    EXPECT_EQ(rows[0].host, "b");
    EXPECT_EQ(rows[0].reason(), WaitReason::kGone);
    EXPECT_NEAR(rows[0].ms, 25, 1e-9);
    // Who is alone is waited for by nobody.
    wall.frame(90ms, drawing(kQuick, 80), 0ms, {});
    EXPECT_EQ(wall.waits.all().size(), 1u);
}

TEST(WaitStatistics, TheReasonsAddUpToTheTimeThatWasWaited) {
    const char* given = std::getenv("TESSERA_SEED");
    const unsigned seed = given ? static_cast<unsigned>(std::stoul(given)) : 1;
    SCOPED_TRACE("TESSERA_SEED=" + std::to_string(seed) + " build/bin/unit_sim --gtest_filter=WaitStatistics.*");
    std::mt19937 random(seed);
    const auto ms = [&](double most) { return std::uniform_real_distribution<>(0, most)(random); };
    const auto someHost = [&](std::vector<std::string> names) {
        HostStats stats{.tiles = {}, .workMs = ms(60), .applyMs = ms(5), .applyQueuedMs = ms(8)};
        for (std::string& name : names)
            stats.tiles.push_back({.tile = std::move(name),
                                   .cullMs = ms(10),
                                   .drawMs = ms(20),
                                   .handOverMs = ms(2),
                                   .cullQueuedMs = ms(12),
                                   .drawQueuedMs = ms(15)});
        return stats;
    };
    WaitingWall wall;
    double waited = 0;
    for (int i = 0; i < 900; ++i) {
        const auto a = std::chrono::duration_cast<Duration>(std::chrono::duration<double, std::milli>(ms(100)));
        const auto b = std::chrono::duration_cast<Duration>(std::chrono::duration<double, std::milli>(ms(100)));
        waited += std::abs(toMilliseconds(a - b));
        // What hosts say need not fit to what the server sees.
        wall.frame(a, someHost({"front-0-0"}), b, someHost({"front-1-0", "front-2-0"}));
    }
    double told = 0;
    std::uint64_t frames = 0;
    const auto rows = wall.waits.all();
    EXPECT_EQ(rows.size(), 3u);
    for (std::size_t i = 0; i < rows.size(); ++i) {
        EXPECT_NEAR(std::accumulate(rows[i].why.begin(), rows[i].why.end(), 0.0), rows[i].ms, 1e-6) << rows[i].tile;
        if (i > 0) {
            EXPECT_LE(rows[i].ms, rows[i - 1].ms) << "worst first";
        }
        told += rows[i].ms;
        frames += rows[i].frames;
    }
    EXPECT_NEAR(told, waited, 1e-6);
    EXPECT_EQ(frames, 900u);
    EXPECT_EQ(wall.waits.recentFrames(), WaitStatistics::kRecent);
    std::uint64_t recent = 0;
    for (const WaitStatistics::Row& row : wall.waits.recent()) recent += row.frames;
    EXPECT_EQ(recent, WaitStatistics::kRecent);
}

}  // namespace
}  // namespace tessera
