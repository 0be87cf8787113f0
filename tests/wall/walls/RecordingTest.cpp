/// What a person did to a wall is made again from its recording: the same contacts, in the same order, and the same
/// scene, for any number of threads; and for any number of hosts.
#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>

#include "server/tools/replay/ReplayCommand.h"
#include "tests/support/wall/AskedWall.h"

namespace tessera::simulation {
namespace {

using nlohmann::json;

const std::string kHall = std::string(TESSERA_SOURCE_DIR) + "/deploy/scenes/engine-hall.tsct";

/// What a replay says of each frame, a line each.
std::vector<std::string> contactLines(const std::string& recording, int threads) {
    const CommandOutcome outcome = runHere([&] {
        return runReplay({recording, "--contacts", "--json", "--threads", std::to_string(threads)});
    });
    EXPECT_EQ(outcome.exitCode, 0) << threads << " threads";
    std::vector<std::string> lines;
    std::istringstream in(outcome.output);
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    // The summary is the last line.
    if (lines.empty()) return lines;
    const json summary = json::parse(lines.back(), nullptr, false);
    lines.pop_back();
    EXPECT_EQ(summary["result"], "same") << summary.dump(2);
    EXPECT_EQ(summary["end"], "closed") << summary.dump(2);
    EXPECT_EQ(summary["threads"], threads);
    EXPECT_EQ(summary["differing_frames"], 0);
    return lines;
}

/// The states that a scene went through, without the numbers of the frames in which it did.
std::vector<json> statesIn(const std::vector<std::string>& lines) {
    std::vector<json> states;
    for (const std::string& line : lines) {
        json state = json::parse(line);
        state.erase("frame");
        if (states.empty() || state != states.back()) states.push_back(std::move(state));
    }
    return states;
}

/// Against the crates, on against them, back, and aside until engine meets engine.
void push(AskedWall& hall) {
    const std::vector<std::vector<std::string>> pushes = {{"12", "0", "0", "--by"},
                                                          {"0.4", "0", "0", "--by"},
                                                          {"-4.6", "0", "0.15"},
                                                          {"-7", "0", "0.15"},
                                                          {"-7", "0", "3"}};
    const std::vector<bool> stopped = {true, true, false, false, true};
    for (std::size_t i = 0; i < pushes.size(); ++i) {
        EXPECT_EQ(hall.move("/hall/trolley", pushes[i]).stopped, stopped[i]) << "push " << i;
        hall.settle();
    }
}

TEST(Recording, OfAPushedEngineIsReplayedTheSameWithAnyNumberOfThreads) {
    if (engineIsMissing()) GTEST_SKIP() << "the engine is missing (Debian package assimp-testmodels)";
    const test::TestFolder folder;
    const std::string recording = folder.path() + "/hall.rec";
    json last, report;
    {
        AskedWall hall({.scene = kHall, .server = {"--assets", kModels, "--threads", "2", "--record", recording}});
        push(hall);
        last = hall.contacts();
        report = hall.finish();
    }
    ASSERT_FALSE(last.empty());
    const std::vector<std::string> lines = contactLines(recording, 1);
    ASSERT_EQ(lines.size(), report["frames"].get<std::size_t>());
    // What tessera-ctl was told on the wall is what the replay finds.
    const json replayed = json::parse(lines.back())["contacts"];
    ASSERT_EQ(replayed.size(), last.size());
    for (std::size_t i = 0; i < last.size(); ++i) {
        EXPECT_EQ(replayed[i]["objects"], last[i]["objects"]);
        EXPECT_EQ(replayed[i]["faces"], last[i]["faces"]);
        EXPECT_EQ(replayed[i]["point"], last[i]["point"]) << "to the last bit";
        EXPECT_EQ(replayed[i]["normal"], last[i]["normal"]);
    }
    for (const int threads : {2, 3}) EXPECT_EQ(contactLines(recording, threads), lines) << threads << " threads";
}

TEST(Recording, OneHostAndFourLeadThroughTheSameContactsAndStates) {
    if (engineIsMissing()) GTEST_SKIP() << "the engine is missing (Debian package assimp-testmodels)";
    // Walls are not pushed in the same frames; so nothing else may move.
    const test::TestFolder folder;
    std::string text = readText(kHall);
    std::size_t motions = 0;
    const std::string motion = "motion {";
    for (std::size_t at = text.find(motion); at != std::string::npos; at = text.find(motion, at + 1), ++motions)
        text.insert(at + motion.size(), " paused: true");
    ASSERT_GT(motions, 0u);
    const std::string scene = folder.write("hall.tsct", text);

    const auto statesOn = [&](const std::string& wall, const std::string& threads) {
        const std::string recording = folder.path() + "/" + wall + ".rec";
        AskedWall hall({.wall = wall,
                        .scene = scene,
                        .widthPx = 160,
                        .heightPx = 90,
                        .server = {"--assets", kModels, "--threads", threads, "--record", recording}});
        push(hall);
        (void)hall.finish();
        return statesIn(contactLines(recording, 1));
    };
    const std::vector<json> four = statesOn("2x2", "3"), one = statesOn("1x1", "1");
    ASSERT_GE(four.size(), 6u) << "the start, and what each push led to";
    EXPECT_EQ(four, one);
}

}  // namespace
}  // namespace tessera::simulation
