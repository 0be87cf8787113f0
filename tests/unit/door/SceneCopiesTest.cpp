/// The scene as a file, where the machine has no room for what that takes.
#include <gtest/gtest.h>

#include <optional>

#include "SealedPeer.h"
#include "server/door/SceneCopies.h"
#include "tests/support/wall/ThreadShortage.h"
#include "tests/support/words/Words.h"
#include "tests/unit/TestFolder.h"

namespace tessera {
namespace {

TEST(SceneCopies, AreRefusedInWordsWhereTheMachineStartsTooFewThreads) {
    if (!simulation::ThreadShortage::kRefuses) GTEST_SKIP() << "a sanitizer stands where threads are refused";
    const test::TestFolder folder;
    boost::asio::io_context io;
    SceneCopies copies(io);
    const auto guard = boost::asio::make_work_guard(io);
    // One for itself, and more for its link.
    for (const int room : {0, 1, 2}) {
        std::optional<HttpAnswer> told;
        const simulation::ThreadShortage shortage(room);
        copies.ask({"127.0.0.1", 1}, "word", SceneEncoding::kText, folder.path(),
                   [&](HttpAnswer answer) { told = std::move(answer); });
        while (!told && io.run_one_for(std::chrono::seconds(20)) > 0) {
        }
        ASSERT_TRUE(told) << room;
        EXPECT_EQ(told->status, 413) << room;
        EXPECT_WORDS(told->body);
    }
    copies.finish();
}

}  // namespace
}  // namespace tessera
