/// What is said is written by somebody else, and nobody waits for it.
#include "common/base/Log.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>

#include "common/base/Error.h"
#include "common/base/FileHandle.h"

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
    void waitForSome() const {
        pollfd ready{.fd = ends_[0], .events = POLLIN, .revents = 0};
        EXPECT_EQ(::poll(&ready, 1, 30'000), 1);
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
    log.info(
        "日本 😀 \xC2\x9B"
        "2J \x9B"
        "2J \u202Egnp\u2028 end");
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

TEST(Log, WhoHasItsFilesNumberAfterwardsIsNotWrittenTo) {
    const std::string tooLong(100'000, 'x');  // for a pipe
    Pipe pipe;
    {
        Log log("test", pipe.in);
        log.info(tooLong);
        pipe.waitForSome();  // so that the other one is written by itself
        log.info("later");
    }
    const int number = ::fileno(pipe.in);
    std::fclose(std::exchange(pipe.in, nullptr));
    const FileHandle made(::memfd_create("other", MFD_CLOEXEC));
    ASSERT_EQ(::dup2(made.get(), number), number);
    const FileHandle other(number);
    EXPECT_EQ(pipe.readUntil("later\n"), "test: " + tooLong + "\ntest: later\n");
    struct stat about {};
    ASSERT_EQ(::fstat(other.get(), &about), 0);
    EXPECT_EQ(about.st_size, 0);
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

/// Where systemd's journal listens, as far as a log sees it.
class Journal {
public:
    Journal() : file_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
        ::unlink(path.c_str());
        sockaddr_un address{};
        address.sun_family = AF_UNIX;
        std::memcpy(address.sun_path, path.data(), path.size());
        EXPECT_EQ(::bind(file_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    }
    ~Journal() {
        ::unlink(path.c_str());
        ::unsetenv("JOURNAL_STREAM");
    }
    Journal(const Journal&) = delete;
    /// As systemd would have started the program.
    static void isStream(std::FILE* out) {
        struct stat info {};
        EXPECT_EQ(::fstat(::fileno(out), &info), 0);
        ::setenv("JOURNAL_STREAM", (std::to_string(info.st_dev) + ":" + std::to_string(info.st_ino)).c_str(), 1);
    }
    std::string next() {
        std::array<char, 4096> some{};
        const ssize_t got = ::recv(file_.get(), some.data(), some.size(), 0);
        return got > 0 ? std::string(some.data(), static_cast<std::size_t>(got)) : "";
    }
    std::string path = testing::TempDir() + "/tessera-journal-" + std::to_string(::getpid());

private:
    FileHandle file_;
};

TEST(Log, InTheJournalAMessageHasItsFields) {
    Journal journal;
    Pipe pipe;
    Journal::isStream(pipe.in);
    Log log("tessera-client[left]", pipe.in, journal.path);
    log.info("joined");
    EXPECT_EQ(journal.next(), "MESSAGE=joined\nPRIORITY=6\nSYSLOG_IDENTIFIER=tessera-client\nTESSERA_HOST=left\n");
    log.warning("frame 7: it is late", {.frame = 7, .tile = "wall-0-1"});
    EXPECT_EQ(journal.next(),
              "MESSAGE=frame 7: it is late\nPRIORITY=4\nSYSLOG_IDENTIFIER=tessera-client\nTESSERA_HOST=left\n"
              "TESSERA_TILE=wall-0-1\nTESSERA_FRAME=7\n");
    // What others said makes no field of its own.
    log.error("no\nPRIORITY=0", {.host = "right\nPRIORITY=0"});
    const std::string text = "no\n    PRIORITY=0", host = "right\n    PRIORITY=0";
    const auto binary = [](const std::string& value) {
        return std::string(1, static_cast<char>(value.size())) + std::string(7, '\0') + value + "\n";
    };
    EXPECT_EQ(journal.next(), "MESSAGE\n" + binary(text) +
                                  "PRIORITY=3\nSYSLOG_IDENTIFIER=tessera-client\nTESSERA_HOST\n" + binary(host));
}

TEST(Log, WhereTheJournalsSocketIsNotReachedALineBeginsWithItsLevel) {
    Pipe pipe;
    Journal journal;
    Journal::isStream(pipe.in);
    Log log("test", pipe.in, "/nonexistent/socket");
    log.info("a");
    log.warning("b");
    log.error("c");
    EXPECT_EQ(pipe.readUntil("c\n"), "<6>test: a\n<4>test: warning: b\n<3>test: c\n");
}

/// JOURNAL_STREAM is inherited by programs whose output goes elsewhere.
TEST(Log, AnotherOutputIsNoJournal) {
    Journal journal;
    Pipe theirs, ours;
    Journal::isStream(theirs.in);
    Log log("test", ours.in, journal.path);
    log.warning("b");
    EXPECT_EQ(ours.readUntil("b\n"), "test: warning: b\n");
}

}  // namespace
}  // namespace tessera
