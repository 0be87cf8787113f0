/// What is said is written by somebody else, and nobody waits for it.
#include "common/base/Log.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <string>

#include "common/base/Error.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;

/// A pipe that nobody reads until asked to.
class Pipe {
public:
    Pipe() {
        EXPECT_EQ(::pipe2(ends_.data(), O_CLOEXEC), 0);
        in = ::fdopen(ends_[1], "w");
    }
    ~Pipe() {
        if (in) std::fclose(in);
        ::close(ends_[0]);
    }
    Pipe(const Pipe&) = delete;
    /// Until `text` has come, or the writer has gone.
    std::string readUntil(const std::string& text) {
        std::array<char, 4096> some{};
        while (all_.find(text) == std::string::npos) {
            const ssize_t got = ::read(ends_[0], some.data(), some.size());
            if (got <= 0) break;
            all_.append(some.data(), static_cast<std::size_t>(got));
        }
        return all_;
    }
    std::FILE* in = nullptr;

private:
    std::array<int, 2> ends_{};
    std::string all_;
};
TEST(Log, WhatItQuotesIsNeitherACommandNorALineOfItsOwn) {
    Pipe pipe;
    Log log("test", pipe.in);
    log.info("Größe\tof \x1b[2J\x7f\rhost\ntessera-server: all is well");
    EXPECT_EQ(pipe.readUntil("well\n"), "test: Größe\\x09of \\x1b[2J\\x7f\\x0dhost\n    tessera-server: all is well\n");
}

TEST(Log, SaysDetailsUntilItIsQuiet) {
    Pipe pipe;
    Log log("test", pipe.in);
    log.detail("joined");
    log.quieten();
    log.detail("joined again");
    log.info("news");
    EXPECT_EQ(pipe.readUntil("news\n"), "test: joined\ntest: news\n");
}

/// A terminal may take these for commands, too, or write what follows from right to left.
TEST(Log, WhatItQuotesLooksLikeNothingElse) {
    Pipe pipe;
    Log log("test", pipe.in);
    log.info("日本 😀 \xC2\x9B" "2J \x9B" "2J \u202Egnp\u2028 end");
    EXPECT_EQ(pipe.readUntil("end\n"), "test: 日本 😀 \\u009b2J \\x9b2J \\u202egnp\\u2028 end\n");
}

TEST(Log, NobodyWaitsForAPipeThatIsFull) {
    Pipe pipe;
    Log log("test", pipe.in);
    const std::string longLine(1000, 'x');
    // A pipe holds 64 KiB, the log 256: a thousand lines more than both.
    for (int i = 0; i < 1500; ++i) log.info(longLine);
    EXPECT_FALSE(log.flush(1ms)) << "nobody has read anything";
    const std::string said = pipe.readUntil("messages are left out");
    EXPECT_NE(said.find("test: warning: "), std::string::npos);
    EXPECT_EQ(said.rfind("test: " + longLine + "\n", 0), 0u) << "the first ones are there";
    log.info("the last word");
    EXPECT_NE(pipe.readUntil("the last word").find("test: the last word\n"), std::string::npos);
}

TEST(Log, ItsEndWaitsForWhatWasSaidButNotForEver) {
    Pipe pipe;
    const auto begin = std::chrono::steady_clock::now();
    {
        Log log("test", pipe.in);
        for (int i = 0; i < 300; ++i) log.info(std::string(1000, 'x'));
    }
    EXPECT_LT(std::chrono::steady_clock::now() - begin, 30s);
    std::string said;
    {
        Log log("test", pipe.in);
        log.warning("late");
        said = pipe.readUntil("late\n");
    }
    EXPECT_NE(said.find("test: warning: late\n"), std::string::npos);
}

TEST(LogDeathTest, ACheckThatFailsComesAfterWhatWasSaid) {
    testing::FLAGS_gtest_death_test_style = "threadsafe";
    EXPECT_DEATH(
        {
            Log log("test");
            log.info("before it");
            TESSERA_CHECK(1 + 1 == 3, "arithmetic");
        },
        "test: before it\n.*CHECK.*arithmetic");
}

}  // namespace
}  // namespace tessera
