// Whole clusters: the real ServerSession and many real ClientSessions in one process, on simulated time and network.
#include <gtest/gtest.h>

#include <unistd.h>
#include <csignal>
#include <cstdlib>
#include <iostream>

#include "tests/sim/Trouble.h"

namespace tessera::simulation {
namespace {

// ---- histories from seeds ------------------------------------------------------------------------------------------

/// Where a CHECK ends the process there is no other way left to say which seed it was.
char seedLine[256];
extern "C" void sayTheSeed(int) {
    [[maybe_unused]] const auto written = write(STDERR_FILENO, seedLine, std::strlen(seedLine));
}

std::string repeatCommand(std::uint64_t seed) {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    return "TESSERA_SEED=" + std::to_string(seed) + " ./bin/sim_cluster --gtest_filter=" + test->test_suite_name() +
           "." + test->name();
}

ClusterConfig configFor(std::uint64_t seed, LateFramePolicy lateFrame) {
    Random random(seed * 31 + 7);
    ClusterConfig config;
    config.seed = seed;
    config.lateFrame = lateFrame;
    config.hosts = 1 + random.below(6);
    config.applications = random.below(3);
    config.ignoresMismatches = random.chance(0.2);
    config.damagedChunkEvery = random.chance(0.15) ? 40 : 0;
    if (random.chance(0.3)) {
        config.latency = 10ms;
        config.jitter = 30ms;
    }
    config.drawTime = random.between(1ms, 12ms);
    return config;
}

/// What came to pass in many histories: laws that nothing tempts prove nothing.
struct Seen {
    std::map<FaultKind, std::uint64_t> faults;
    std::uint64_t frames = 0, entries = 0, images = 0, replies = 0, refusals = 0;

    void add(Cluster& cluster) {
        for (int kind = 0; kind <= static_cast<int>(FaultKind::kNotShown); ++kind)
            faults[static_cast<FaultKind>(kind)] += cluster.server().faults(static_cast<FaultKind>(kind));
        frames += cluster.server().released();
        entries += cluster.server().entries();
        images += cluster.server().images();
        for (std::size_t i = 0; i < cluster.applicationCount(); ++i) replies += cluster.application(i).replies();
        for (const Stranger& stranger : cluster.strangers()) refusals += stranger.refused();
    }
};

/// Nothing when every law held.
std::optional<std::string> brokenLaw(const ClusterConfig& config, std::uint64_t& fingerprint, Seen& seen) {
    Cluster cluster(config);
    if (config.damagedChunkEvery)
        for (std::size_t i = 0; i < config.hosts; ++i) cluster.server().mayFail(Cluster::hostName(i));
    try {
        Trouble(cluster).live();
    } catch (const Violation& violation) {
        return std::string(violation.what()) + "\n" + cluster.story();
    }
    fingerprint = cluster.fingerprint();
    seen.add(cluster);
    return std::nullopt;
}

void surviveFaults(LateFramePolicy lateFrame, std::uint64_t seeds) {
    std::uint64_t first = 1, last = seeds;
    if (const char* more = std::getenv("TESSERA_SEEDS")) last = std::strtoull(more, nullptr, 10);
    const char* only = std::getenv("TESSERA_SEED");
    if (only) first = last = std::strtoull(only, nullptr, 10);
    Seen seen;
    const auto before = std::signal(SIGABRT, sayTheSeed);
    for (std::uint64_t seed = first; seed <= last; ++seed) {
        const std::string line = "seed " + std::to_string(seed) + "; again: " + repeatCommand(seed) + "\n";
        std::snprintf(seedLine, sizeof seedLine, "%s", line.c_str());
        std::uint64_t fingerprint = 0;
        if (const auto broken = brokenLaw(configFor(seed, lateFrame), fingerprint, seen)) {
            ADD_FAILURE() << *broken << line;
            return;
        }
    }
    std::signal(SIGABRT, before);
    if (only) return;
    for (const auto& [kind, count] : seen.faults) EXPECT_GT(count, 0u) << "no history has the fault " << nameOf(kind);
    for (const std::uint64_t count : {seen.frames, seen.entries, seen.images, seen.replies, seen.refusals})
        EXPECT_GT(count, 0u);
    std::cout << "            " << seen.frames << " frames, " << seen.entries << " entries, faults:";
    for (const auto& [kind, count] : seen.faults) std::cout << ' ' << nameOf(kind) << ' ' << count;
    std::cout << '\n';
}

TEST(ClusterSimulation, KeepsItsLawsWhereEverybodyWaits) {
    surviveFaults(LateFramePolicy::kWait, 200);
}
TEST(ClusterSimulation, KeepsItsLawsWhereLateHostsHold) {
    surviveFaults(LateFramePolicy::kHold, 150);
}
TEST(ClusterSimulation, KeepsItsLawsWhereLateHostsDrop) {
    surviveFaults(LateFramePolicy::kDrop, 150);
}

TEST(ClusterSimulation, TheSameSeedIsTheSameHistory) {
    std::uint64_t first = 0, second = 0, other = 0;
    Seen seen;
    EXPECT_EQ(brokenLaw(configFor(5, LateFramePolicy::kWait), first, seen), std::nullopt);
    EXPECT_EQ(brokenLaw(configFor(5, LateFramePolicy::kWait), second, seen), std::nullopt);
    EXPECT_EQ(brokenLaw(configFor(6, LateFramePolicy::kWait), other, seen), std::nullopt);
    EXPECT_EQ(first, second);
    EXPECT_NE(first, other);
}

// ---- single stories, with what each costs the others ---------------------------------------------------------------

/// Interval, drawing, both ways over the slowest link and the processes' own slack.
constexpr Duration kUsualGap = 35ms;
constexpr Duration kLateAfter = 30ms;  ///< what the policy of these walls says

struct Running : Cluster {
    explicit Running(ClusterConfig config = {}) : Cluster(config) {
        startAll();
        EXPECT_TRUE(runUntilAllInStep(1s));
        run(200ms);
        EXPECT_GT(longestGap(), 0ms);  // and forgets what came before
    }
};

TEST(ClusterSimulation, AHealthyWallNeitherFaultsNorStumbles) {
    Running wall({.hosts = 16, .applications = 2});
    wall.run(5s);
    EXPECT_LE(wall.longestGap(), kUsualGap);
    wall.requireEverybodyInStep();
    wall.server().finish();
    wall.run(100ms);
    wall.requireEverybodyFinished();
}

TEST(ClusterSimulation, AKilledHostCostsTheOthersNothingAndComesBack) {
    Running wall;
    wall.server().mayFail("host1");
    wall.host(1).crash(true);
    wall.run(300ms);
    EXPECT_LE(wall.longestGap(), kUsualGap);
    EXPECT_EQ(wall.server().faults(FaultKind::kDisconnected), 1u);
    wall.host(1).start();
    EXPECT_TRUE(wall.runUntilAllInStep(300ms));
    EXPECT_LE(wall.longestGap(), kUsualGap);
}

TEST(ClusterSimulation, AFrozenHostCostsTheOthersItsSilenceAndNoMore) {
    Running wall;
    wall.server().mayFail("host1");
    wall.host(1).freeze();
    wall.run(1s);
    const Duration gap = wall.longestGap();
    EXPECT_LE(gap, 250ms + kUsualGap);
    EXPECT_GE(gap, 100ms);  // it was waited for
    EXPECT_EQ(wall.server().faults(FaultKind::kSilent), 1u);
    wall.host(1).thaw();
    EXPECT_TRUE(wall.runUntilAllInStep(500ms));
}

TEST(ClusterSimulation, ACutCableIsFoundAsFastAsAFrozenHost) {
    Running wall;
    wall.server().mayFail("host1");
    wall.host(1).cutCable();
    wall.run(1s);
    EXPECT_LE(wall.longestGap(), 250ms + kUsualGap);
    EXPECT_TRUE(wall.runUntilAllInStep(2s));  // the client notices by itself and dials again
}

TEST(ClusterSimulation, AHungDrawThreadCostsTheOthersOneFrameDeadline) {
    Running wall;
    wall.server().mayFail("host1");
    wall.host(1).hangDrawing(2s);
    wall.run(1s);
    const Duration gap = wall.longestGap();
    EXPECT_LE(gap, 600ms + kUsualGap);
    EXPECT_GE(gap, 600ms);
    EXPECT_EQ(wall.server().faults(FaultKind::kDrawStalled), 1u);
    EXPECT_EQ(wall.server().faults(FaultKind::kSilent), 0u);
    EXPECT_TRUE(wall.runUntilAllInStep(2s));
}

TEST(ClusterSimulation, AHostThatOnlyClaimsToBeAliveHoldsTheOthersUpOnceAndIsOutUntilItShows) {
    Running wall;
    wall.server().mayFail("host1");
    wall.host(1).stopShowing();
    wall.run(1s);
    const Duration gap = wall.longestGap();
    EXPECT_LE(gap, 250ms + kUsualGap);
    EXPECT_GE(gap, 250ms);
    EXPECT_EQ(wall.server().faults(FaultKind::kNotShown), 1u);
    EXPECT_EQ(wall.server().faults(FaultKind::kSilent), 0u) << "its heartbeats go on";
    wall.run(5s);
    EXPECT_LE(wall.longestGap(), kUsualGap) << "nobody waits for it any more";
    EXPECT_EQ(wall.server().faults(FaultKind::kNotShown), 1u);
    EXPECT_EQ(wall.server().entries(), 4u) << "it is not let in again before it shows";
    wall.host(1).showAgain();
    EXPECT_TRUE(wall.runUntilAllInStep(500ms));
    EXPECT_EQ(wall.server().entries(), 5u);
}

TEST(ClusterSimulation, AHostThatAnswersAndNeverDrawsHoldsTheOthersUpOnceThoughItComesBack) {
    Running wall;
    wall.server().mayFail("host1");
    wall.host(1).loseReadies(true);
    wall.run(1s);
    const Duration gap = wall.longestGap();
    EXPECT_LE(gap, 600ms + kUsualGap);
    EXPECT_GE(gap, 600ms);
    wall.run(10s);
    EXPECT_LE(wall.longestGap(), kLateAfter + kUsualGap) << "nobody waits for it any more";
    EXPECT_GT(wall.server().faults(FaultKind::kDrawStalled), 3u) << "it has come back again and again";
    wall.host(1).loseReadies(false);
    EXPECT_TRUE(wall.runUntilAllInStep(2s));
    wall.run(100ms);
    (void)wall.longestGap();
    wall.host(1).loseReadies(true);
    wall.run(1s);
    EXPECT_GE(wall.longestGap(), 600ms) << "it has proved itself, and is waited for";
    wall.run(5s);
    EXPECT_LE(wall.longestGap(), kLateAfter + kUsualGap);
}

TEST(ClusterSimulation, AHostThatShowsTooLateEachTimeHoldsTheOthersUpOnce) {
    Running wall;
    wall.server().mayFail("host1");
    wall.host(1).showLater(400ms);
    wall.run(1s);
    const Duration gap = wall.longestGap();
    EXPECT_LE(gap, 250ms + kUsualGap);
    EXPECT_GE(gap, 250ms);
    wall.run(10s);
    EXPECT_LE(wall.longestGap(), kLateAfter + kUsualGap);
    EXPECT_GT(wall.server().faults(FaultKind::kNotShown), 3u) << "it has come back again and again";
    wall.host(1).showLater({});
    EXPECT_TRUE(wall.runUntilAllInStep(2s));
}

/// What holds up more and more seldom costs less and less: every time it has to draw and show twice as many frames
/// first.
TEST(ClusterSimulation, AHostThatStallsAsSoonAsItIsTrustedIsTrustedMoreAndMoreSlowly) {
    Running wall;
    wall.server().mayFail("host1");
    int heldUp = 0;
    for (int i = 0; i < 200; ++i) {
        wall.host(1).loseReadies(true);
        wall.run(700ms);  // the frame deadline, and the way out
        if (wall.longestGap() >= 600ms) ++heldUp;
        wall.host(1).loseReadies(false);
        wall.run(200ms);
    }
    EXPECT_GE(heldUp, 3);
    EXPECT_LE(heldUp, 12) << "of 200 times";
}

TEST(ClusterSimulation, AHostThatShowsLateButAnswersIsWaitedForAndNoFrameIsAhead) {
    Running wall;
    for (int i = 0; i < 10; ++i) {
        wall.host(1).stopShowing();
        wall.run(200ms);                // nearly what a silent one may take
        wall.requireEverybodyInStep();  // a fault would have thrown
        wall.host(1).showAgain();
        wall.run(100ms);
        const Duration gap = wall.longestGap();
        EXPECT_LE(gap, 200ms + kUsualGap);
        EXPECT_GE(gap, 150ms) << "another frame began meanwhile";
    }
}

TEST(ClusterSimulation, UnderHoldAHungDrawThreadCostsTheOthersOneLateFrame) {
    Running wall({.lateFrame = LateFramePolicy::kHold});
    wall.server().mayFail("host1");
    wall.host(1).hangDrawing(400ms);
    wall.run(1s);
    EXPECT_LE(wall.longestGap(), 30ms + kUsualGap);
    EXPECT_EQ(wall.server().faults(FaultKind::kDrawStalled), 0u);
    EXPECT_EQ(wall.server().entries(), 4u);  // it stayed a member
    EXPECT_TRUE(wall.runUntilAllInStep(100ms));
}

TEST(ClusterSimulation, UnderDropAHungDrawThreadLeavesAndComesBack) {
    Running wall({.lateFrame = LateFramePolicy::kDrop});
    wall.server().mayFail("host1");
    wall.host(1).hangDrawing(400ms);
    wall.run(1s);
    EXPECT_LE(wall.longestGap(), 30ms + kUsualGap);
    EXPECT_EQ(wall.server().entries(), 5u);
    EXPECT_TRUE(wall.runUntilAllInStep(100ms));
}

TEST(ClusterSimulation, AStandstillOfTheServerCondemnsNobody) {
    Running wall;
    for (int i = 0; i < 20; ++i) {
        if (i % 2 == 0)
            wall.server().stall(Duration(50ms) * (i + 1));
        else
            wall.server().freeze(Duration(50ms) * (i + 1));
        wall.run(1'300ms);
    }
    wall.requireEverybodyInStep();  // a false alarm would have thrown
}

TEST(ClusterSimulation, AServerThatIsAlwaysSlowStillFindsASilentHost) {
    for (const std::size_t hosts : {1, 4}) {
        Running wall({.hosts = hosts});
        wall.server().mayFail("host0");
        wall.host(0).freeze();
        for (int i = 0; i < 10; ++i) {
            wall.server().stall(150ms);
            wall.run(150ms);
        }
        EXPECT_EQ(wall.server().faults(FaultKind::kSilent), 1u) << hosts;
    }
}

TEST(ClusterSimulation, ACorruptedReplicaIsRepairedWhileTheOthersGoOn) {
    Running wall;
    wall.server().mayFail("host1");
    wall.host(1).corrupt();
    wall.run(300ms);
    EXPECT_LE(wall.longestGap(), kUsualGap);
    EXPECT_EQ(wall.server().faults(FaultKind::kStateMismatch), 1u);
    EXPECT_EQ(wall.server().faults(FaultKind::kDisconnected), 0u);
    EXPECT_TRUE(wall.runUntilAllInStep(300ms));
}

TEST(ClusterSimulation, AnnouncedBlobsNeverMakeAFrameWait) {
    Running wall;
    for (int i = 0; i < 20; ++i) {
        wall.server().announceBlobs();
        wall.run(50ms);
    }
    EXPECT_LE(wall.longestGap(), kUsualGap);
}

TEST(ClusterSimulation, StrangersAreClosedAndDisturbNobody) {
    Running wall;
    for (std::uint64_t manner = 0; manner < Stranger::kManners; ++manner)
        for (int i = 0; i < 3; ++i) wall.addStranger(static_cast<Stranger::Manner>(manner), "host1");
    wall.run(1s);
    EXPECT_LE(wall.longestGap(), kUsualGap);
    for (const Stranger& stranger : wall.strangers()) EXPECT_TRUE(stranger.gone());
    wall.requireEverybodyInStep();
}

TEST(ClusterSimulation, ALateHostIsWaitedForOnlyUntilTheStartDeadline) {
    Cluster wall({.hosts = 3});
    wall.startServer();
    wall.host(0).start();
    wall.host(1).start();
    wall.run(1'450ms);
    EXPECT_EQ(wall.server().released(), 0u);
    wall.run(200ms);
    EXPECT_GT(wall.server().released(), 3u);
    wall.host(2).start();
    EXPECT_TRUE(wall.runUntilAllInStep(300ms));
}

}  // namespace
}  // namespace tessera::simulation
