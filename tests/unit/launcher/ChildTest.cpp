#include "deploy/wall/Child.h"
#include "tests/support/words/Words.h"

#include <poll.h>
#include <signal.h>
#include <sys/wait.h>

#include <chrono>

#include "tests/unit/Eventually.h"
#include "tests/unit/launcher/Stage.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;
using test::eventually;

class ChildProcess : public test::Stage {
protected:
    /// Reads until the streams end, ten seconds at most.
    static std::vector<std::string> everything(Child& child, Child::Stream stream) {
        std::vector<std::string> all;
        const auto deadline = std::chrono::steady_clock::now() + 10s;
        while (child.handle(stream) >= 0 && std::chrono::steady_clock::now() < deadline) {
            pollfd handle{.fd = child.handle(stream), .events = POLLIN, .revents = 0};
            ::poll(&handle, 1, 100);
            for (std::string& line : child.readLines(stream)) all.push_back(std::move(line));
        }
        return all;
    }
    static std::optional<ChildEnd> endOf(Child& child) {
        std::optional<ChildEnd> end;
        (void)eventually([&] { return (end = child.reap()).has_value(); });
        return end;
    }
    /// Gone, or dead and waiting for whoever has inherited it to notice.
    [[nodiscard]] bool gone(pid_t pid) const {
        const std::string status = read("/proc/" + std::to_string(pid) + "/stat");
        return status.empty() || status.find(") Z") != std::string::npos;
    }
};

TEST_F(ChildProcess, HandsOnLinesArgumentsAndExitCode) {
    Expected<Child> child =
        Child::start({.program = program("p", "echo \"$1|$2\"; echo oops >&2; printf unfinished; exit 3"),
                      .arguments = {"a b", "*"}});
    ASSERT_TRUE(child) << child.error().message;
    EXPECT_EQ(everything(*child, Child::kOut), (std::vector<std::string>{"a b|*", "unfinished"}));
    EXPECT_EQ(everything(*child, Child::kError), (std::vector<std::string>{"oops"}));
    const std::optional<ChildEnd> end = endOf(*child);
    ASSERT_TRUE(end);
    EXPECT_FALSE(end->good());
    EXPECT_EQ(describe(*end), "ended with exit code 3");
    EXPECT_FALSE(child->running());
    EXPECT_FALSE(child->reap()) << "once";
}

TEST_F(ChildProcess, HasOurEnvironmentWithChanges) {
    ::setenv("TESSERA_STAGE_A", "ours", 1);
    ::setenv("TESSERA_STAGE_B", "ours", 1);
    Expected<Child> child = Child::start({.program = program("p", "echo $TESSERA_STAGE_A $TESSERA_STAGE_B"),
                                          .environment = {{"TESSERA_STAGE_B", "changed"}}});
    ASSERT_TRUE(child);
    EXPECT_EQ(everything(*child, Child::kOut), (std::vector<std::string>{"ours changed"}));
}

TEST_F(ChildProcess, ReadsWhatItIsFed) {
    Expected<Child> child = Child::start({.program = program("p", "wc -c"), .feedInput = true});
    ASSERT_TRUE(child);
    const std::string data(300'000, 'x');
    EXPECT_TRUE(child->feed(data.data(), data.size()));
    child->closeInput();
    EXPECT_EQ(everything(*child, Child::kOut), (std::vector<std::string>{"300000"}));
}

TEST_F(ChildProcess, ThatNoLongerReadsIsAnErrorAndNoSignal) {
    Expected<Signals> signals = Signals::take();
    Expected<Child> child = Child::start({.program = program("p", "exec <&-; exit 0"), .feedInput = true});
    ASSERT_TRUE(child);
    ASSERT_TRUE(endOf(*child));
    const std::string data(300'000, 'x');
    EXPECT_FALSE(child->feed(data.data(), data.size()));
}

/// A terminal that is closed ends the wall in order, but for those who said that they outlive it (nohup).
TEST(Signals, AClosedTerminalIsAWishToEndUnlessItIsIgnored) {
    for (const bool ignored : {false, true}) {
        const auto before = ::signal(SIGHUP, ignored ? SIG_IGN : SIG_DFL);
        {
            Expected<Signals> signals = Signals::take();
            ASSERT_TRUE(signals);
            EXPECT_FALSE(signals->takeStopRequest());
            ASSERT_EQ(::raise(SIGHUP), 0);
            EXPECT_EQ(signals->takeStopRequest(), !ignored);
        }
        ::signal(SIGHUP, before);
    }
}

TEST_F(ChildProcess, ThatIsNotThereIsNamed) {
    const Expected<Child> child = Child::start({.program = (folder_ / "nothing").string()});
    ASSERT_FALSE(child);
    EXPECT_EQ(child.error().code, ErrorCode::kNotFound);
    EXPECT_WORDS(child.error().message);
    std::ofstream(folder_ / "text") << "no program";
    EXPECT_FALSE(Child::start({.program = (folder_ / "text").string()}));
}

TEST_F(ChildProcess, IsSeenToBeStoppedAndKilled) {
    Expected<Child> child = Child::start({.program = program("p", "exec sleep 30")});
    ASSERT_TRUE(child);
    EXPECT_FALSE(child->stopped());
    child->send(SIGSTOP);
    EXPECT_TRUE(eventually([&] { return child->stopped(); }));
    EXPECT_TRUE(child->stopped()) << "asking does not change it";
    child->send(SIGKILL);
    const std::optional<ChildEnd> end = endOf(*child);
    ASSERT_TRUE(end);
    EXPECT_EQ(describe(*end), "was killed by signal 9 (Killed)");
    EXPECT_EQ(adviceAfter(*end, "tessera-client"), "") << "somebody has killed it: it did not crash";
}

TEST_F(ChildProcess, HasAdviceWhereItHasCrashed) {
    Expected<Child> child = Child::start({.program = program("p", "kill -SEGV $$")});
    ASSERT_TRUE(child);
    const std::optional<ChildEnd> end = endOf(*child);
    ASSERT_TRUE(end);
    EXPECT_EQ(describe(*end) + adviceAfter(*end, "tessera-client"),
              "was killed by signal 11 (Segmentation fault); `coredumpctl info tessera-client` shows where "
              "(troubleshooting.md, \"A program has crashed\")");
    EXPECT_EQ(adviceAfter({.signalled = false, .value = 3}, "tessera-server"), "");
}

TEST_F(ChildProcess, DoesNotOutliveItsObject) {
    pid_t pid = 0;
    {
        const Expected<Child> child = Child::start({.program = program("p", "exec sleep 30")});
        ASSERT_TRUE(child);
        pid = child->pid();
        EXPECT_FALSE(gone(pid));
    }
    EXPECT_TRUE(gone(pid));
}

TEST_F(ChildProcess, TakesAlongWhatItStarted) {
    // As ssh does for a way over another machine: ended from here, by its own will, or with its object.
    const std::string starter = program("p", "sleep 30 & echo $!; exec sleep $1");
    for (const char* how : {"terminated", "ended", "destroyed"}) {
        Expected<Child> child =
            Child::start({.program = starter, .arguments = {how == std::string("ended") ? "0" : "30"}});
        ASSERT_TRUE(child);
        std::vector<std::string> lines;
        (void)eventually([&] { return !(lines = child->readLines(Child::kOut)).empty(); });
        ASSERT_EQ(lines.size(), 1u) << how;
        const pid_t its = std::stoi(lines[0]);
        if (how == std::string("destroyed")) {
            *child = Child::start({.program = program("q", "true")}).value();
        } else {
            if (how == std::string("terminated")) child->send(SIGTERM);
            ASSERT_TRUE(endOf(*child)) << how;
        }
        EXPECT_TRUE(eventually([&] { return gone(its); })) << how;
    }
}

TEST_F(ChildProcess, DoesNotOutliveAParentThatIsKilled) {
    const std::string sleeper = program("p", "exec sleep 30");
    int ends[2];
    ASSERT_EQ(::pipe(ends), 0);
    const pid_t parent = ::fork();
    if (parent == 0) {
        const Expected<Child> child = Child::start({.program = sleeper});
        const pid_t pid = child ? child->pid() : -1;
        [[maybe_unused]] const ssize_t told = ::write(ends[1], &pid, sizeof(pid));
        ::kill(::getpid(), SIGKILL);
    }
    pid_t grandchild = 0;
    ASSERT_EQ(::read(ends[0], &grandchild, sizeof(grandchild)), static_cast<ssize_t>(sizeof(grandchild)));
    ::waitpid(parent, nullptr, 0);
    ::close(ends[0]);
    ::close(ends[1]);
    ASSERT_GT(grandchild, 0);
    EXPECT_TRUE(eventually([&] { return gone(grandchild); }));
}

TEST_F(ChildProcess, LongLinesAreCut) {
    Expected<Child> child = Child::start({.program = program("p", "head -c 20000 /dev/zero | tr '\\0' x")});
    ASSERT_TRUE(child);
    const std::vector<std::string> lines = everything(*child, Child::kOut);
    ASSERT_EQ(lines.size(), 3u);
    EXPECT_EQ(lines[0].size(), 8192u);
    EXPECT_EQ(lines[0].size() + lines[1].size() + lines[2].size(), 20000u);
}

}  // namespace
}  // namespace tessera
