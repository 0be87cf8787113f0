#include "common/base/ChildProgram.h"

#include <gtest/gtest.h>

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <optional>

#include "common/base/FileHandle.h"
#include "tests/support/words/Words.h"

namespace tessera {
namespace {

struct Ended {
    std::string said;
    int status = 0;
};

/// A shell that does that, its outputs read to their end.
Ended shell(const std::string& what, std::vector<ChildProgram::Given> files = {},
            std::vector<std::string> environment = {}) {
    std::array<int, 2> ends{};
    EXPECT_EQ(::pipe2(ends.data(), O_CLOEXEC), 0);
    const FileHandle readEnd(ends[0]);
    std::optional<FileHandle> writeEnd(ends[1]);
    files.push_back({writeEnd->get(), 1});
    Expected<ChildProgram> child = ChildProgram::start({.path = "/bin/sh",
                                                        .arguments = {"-c", what},
                                                        .environment = std::move(environment),
                                                        .files = std::move(files)});
    if (!child) {
        ADD_FAILURE() << child.error().message;
        return {};
    }
    writeEnd.reset();
    Ended ended;
    std::array<char, 4096> piece{};
    for (ssize_t got = 0; (got = ::read(readEnd.get(), piece.data(), piece.size())) > 0;)
        ended.said.append(piece.data(), static_cast<std::size_t>(got));
    ended.status = child->reap();
    EXPECT_LT(child->pid(), 0);
    EXPECT_EQ(child->kill(), 0) << "there is none any more";
    return ended;
}

bool isGone(pid_t pid) {
    return ::waitpid(pid, nullptr, WNOHANG) == -1 && errno == ECHILD;
}

TEST(ChildProgram, HasTheFilesAndVariablesThatItIsGivenAndNoOthers) {
    ASSERT_EQ(::setenv("TESSERA_NOT_FOR_CHILDREN", "1", 1), 0);
    const Ended variables = shell("exec /usr/bin/env", {}, {"FOR_CHILDREN=2"});
    ::unsetenv("TESSERA_NOT_FOR_CHILDREN");
    EXPECT_NE(variables.said.find("LC_ALL=C\n"), std::string::npos) << variables.said;
    EXPECT_NE(variables.said.find("FOR_CHILDREN=2\n"), std::string::npos) << variables.said;
    EXPECT_EQ(variables.said.find("TESSERA_NOT"), std::string::npos) << variables.said;

    // One stands where another is to come, one where it is to come itself, one is not for it at all, though it is not
    // close-on-exec.
    std::array<int, 2> first{}, second{};
    ASSERT_EQ(::pipe(first.data()), 0);
    ASSERT_EQ(::pipe(second.data()), 0);
    ASSERT_EQ(::write(first[1], "one\n", 4), 4);
    ASSERT_EQ(::write(second[1], "two\n", 4), 4);
    const std::array<FileHandle, 4> owned = {FileHandle(first[0]), FileHandle(first[1]), FileHandle(second[0]),
                                             FileHandle(second[1])};
    const Ended files =
        shell("read a <&" + std::to_string(second[0]) + "; read b <&" + std::to_string(first[0]) +
                  "; echo $a $b; for i in " + std::to_string(first[1]) + " " + std::to_string(second[1]) +
                  "; do [ -e /proc/$$/fd/$i ] && echo $i is open; done; readlink /proc/self/fd/0 /proc/self/fd/2",
              {{first[0], second[0]}, {second[0], first[0]}});
    ASSERT_TRUE(files.said.starts_with("one two\n")) << files.said;
    EXPECT_EQ(files.said.substr(8), "/dev/null\n/dev/null\n") << "nothing else is open";
    const FileHandle empty(::open("/dev/null", O_RDONLY));
    const Ended own = shell("read a <&" + std::to_string(empty.get()) + " || echo end", {{empty.get(), empty.get()}});
    EXPECT_EQ(own.said, "end\n");
}

TEST(ChildProgram, EndsAsItLikesOrWithItsOwner) {
    const Ended seven = shell("exit 7");
    EXPECT_TRUE(WIFEXITED(seven.status));
    EXPECT_EQ(WEXITSTATUS(seven.status), 7);
    const Ended signal = shell("kill -ABRT $$");
    EXPECT_TRUE(WIFSIGNALED(signal.status));
    EXPECT_EQ(WTERMSIG(signal.status), SIGABRT);

    const auto sleeper = [] {
        Expected<ChildProgram> child =
            ChildProgram::start({.path = "/bin/sleep", .arguments = {"1000"}, .environment = {}, .files = {}});
        EXPECT_TRUE(child);
        EXPECT_EQ(::getpgid(child->pid()), child->pid()) << "a group of its own";
        return std::move(*child);
    };
    pid_t left = 0, replaced = 0;
    {
        ChildProgram kept = sleeper();
        left = kept.pid();
        ChildProgram moved = std::move(kept);
        EXPECT_EQ(moved.pid(), left);
        EXPECT_EQ(::kill(left, 0), 0) << "it lives";
        replaced = left;
        moved = sleeper();
        EXPECT_TRUE(isGone(replaced));
        left = moved.pid();
    }
    EXPECT_TRUE(isGone(left));
    ChildProgram killed = sleeper();
    const int status = killed.kill();
    EXPECT_TRUE(WIFSIGNALED(status));
    EXPECT_EQ(WTERMSIG(status), SIGKILL);
}

TEST(ChildProgram, SaysWhyItCannotBeStarted) {
    const Expected<ChildProgram> nowhere =
        ChildProgram::start({.path = "/nowhere/at-all", .arguments = {}, .environment = {}, .files = {}});
    ASSERT_FALSE(nowhere);
    EXPECT_EQ(nowhere.error().message,
              "'/nowhere/at-all' cannot be started: No such file or directory; it belongs beside the running program");
    const Expected<ChildProgram> noFile =
        ChildProgram::start({.path = "/bin/true", .arguments = {}, .environment = {}, .files = {{-1, 3}}});
    ASSERT_FALSE(noFile);
    EXPECT_WORDS(noFile.error().message);
}

}  // namespace
}  // namespace tessera
