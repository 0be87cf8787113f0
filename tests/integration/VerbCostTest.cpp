/// What tessera-ctl is sent for each verb: its answer, however large the scene is.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>

#include "tests/integration/CountingProxy.h"
#include "tests/integration/ThreadWall.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

constexpr int kRows = 100, kInRow = 1000;

/// /row0 … /row99, each of 1000 nodes that can be moved.
std::string largeScene() {
    std::string text;
    for (int row = 0; row < kRows; ++row) {
        text += fmt::format("node {{ name: \"row{}\" transform {{}}\n", row);
        for (int i = 0; i < kInRow; ++i)
            text +=
                fmt::format("  node {{ name: \"part{}\" transform {{ translation {{ x: {} y: {} }} }} }}\n", i, i, row);
        text += "}\n";
    }
    return text;
}

TEST(VerbCost, EachVerbIsSentItsAnswerAndNotTheScene) {
    const TemporaryFolder folder;
    ThreadWall wall({.wall = "1x1", .scene = folder.write("rows.tsct", largeScene())});
    ASSERT_FALSE(wall.address().empty()) << wall.logs();
    wall.startClient("all");
    ASSERT_TRUE(wall.waitForFrame("front-0-0", 3, 120s)) << wall.logs();
    CountingProxy proxy(wall.address());
    const auto ask = [&](std::vector<std::string> words) {
        words.insert(words.begin(), {"--server", proxy.address(), "--token-file", wall.tokenFile(), "--timeout", "60"});
        return ctlHere(words);
    };
    struct Case {
        std::vector<std::string> words;
        std::uint64_t mostBytes;
    };
    // Heartbeats come on top, ten or so on a slow machine.
    for (const Case& c : std::vector<Case>{
             {{"status"}, 8192},
             {{"tree", "/", "--depth", "1"}, 65'536},
             {{"tree", "/row7/part41"}, 8192},
             {{"move", "/row99/part998", "1", "2", "3"}, 16'384},
             {{"set", "/row5/part5", "translation", "4", "5", "6"}, 16'384},
             {{"undo"}, 8192},
             {{"redo"}, 8192},
             {{"remove", "/row50/part500"}, 16'384},
             {{"view", "--position", "0", "0", "9"}, 8192},
             {{"pick", "80", "45"}, 8192},
             {{"contacts"}, 16'384},
             {{"questions"}, 8192},
             {{"snapshot", folder.path() + "/wall.png"}, 262'144},
         }) {
        (void)proxy.taken();
        const Outcome outcome = ask(c.words);
        EXPECT_EQ(outcome.exitCode, 0) << c.words[0] << ": " << outcome.output;
        EXPECT_LT(proxy.taken(), c.mostBytes) << c.words[0];
    }
    // All of it is told where all of it is asked for, in pages.
    const Outcome tree = ask({"tree"});
    EXPECT_EQ(tree.exitCode, 0) << tree.output.substr(0, 1000);
    EXPECT_EQ(std::count(tree.output.begin(), tree.output.end(), '\n'), 1 + kRows + kRows * kInRow - 1);
    EXPECT_GT(proxy.taken(), 1'000'000u) << "the scene does pass through where somebody wants it";
    EXPECT_FALSE(wall.finish().is_null()) << wall.logs();
}

}  // namespace
}  // namespace tessera::test
