/// The life of a run's processes, with scripts in the roles of server and clients.
#include "deploy/wall/WallRun.h"

#include <signal.h>

#include <chrono>
#include <filesystem>

#include "tests/unit/launcher/Stage.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;

class WallRunning : public test::Stage {
protected:
    /// Runs both roles; the hosts are "a" and "b".
    Expected<WallRunResult> run(const std::string& server, const std::string& client) {
        options_.serverProgram = program("server", server);
        options_.clientProgram = program("client", "host=$4\n" + client);
        options_.hosts = {"a", "b"};
        Expected<Signals> signals = Signals::take();
        EXPECT_TRUE(signals);
        return runWall(options_, *signals, console());
    }

    WallRunOptions options_{.startDeadline = 10s, .finishDeadline = 5s, .killAfter = 300ms, .restartDelay = 20ms};
    static constexpr const char* kListen = "echo 'tessera-server: listening on 127.0.0.1:4711'\n";
};

TEST_F(WallRunning, StartsAClientPerHostWhenTheServerListens) {
    options_.serverArguments = {"--frames", "7"};
    options_.clientArguments = {"--culler", "none"};
    options_.clientEnvironment = {{"STAGE_COLOR", "blue"}};
    const Expected<WallRunResult> result =
        run("echo \"$@\" >$S/server.args\nsleep 0.1\n" + std::string(kListen) +
                "await $S/a; await $S/b; echo progress 7 7; exit 0",
            "echo \"$@\" $STAGE_COLOR >$S/$host; echo \"tessera-client[$host]: hello\" >&2");
    ASSERT_TRUE(result) << result.error().message;
    EXPECT_TRUE(result->server.good());
    EXPECT_FALSE(result->interrupted || result->deserted);
    EXPECT_EQ(read(folder_ / "server.args"), "--frames 7\n");
    EXPECT_EQ(read(folder_ / "a"), "--server 127.0.0.1:4711 --host a --culler none blue\n");
    EXPECT_EQ(read(folder_ / "b"), "--server 127.0.0.1:4711 --host b --culler none blue\n");
    EXPECT_SAID("role server host -\n");
    EXPECT_SAID("role client host a\n");
    EXPECT_SAID("role client host b\n");
    EXPECT_SAID("tessera-client[a]: hello\n");
    EXPECT_SAID("7 of 7 frames\n");
    EXPECT_EQ(said().find("progress 7"), std::string::npos);
    EXPECT_EQ(said().find("warning"), std::string::npos) << said();
}

TEST_F(WallRunning, PassesOnWhyAServerDoesNotStart) {
    const Expected<WallRunResult> result =
        run("echo 'tessera-server: error: hall.tsct:3:1: no such thing' >&2; exit 3", "touch $S/started");
    ASSERT_TRUE(result);
    EXPECT_EQ(result->server.value, 3);
    EXPECT_SAID("tessera-server: error: hall.tsct:3:1: no such thing\n");
    EXPECT_FALSE(has("started"));
}

TEST_F(WallRunning, NamesAProgramThatIsMissing) {
    options_.serverProgram = (folder_ / "nowhere").string();
    options_.hosts = {"a"};
    Expected<Signals> signals = Signals::take();
    const Expected<WallRunResult> result = runWall(options_, *signals, console());
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, ErrorCode::kNotFound);
}

TEST_F(WallRunning, GivesUpOnAServerThatNeverListens) {
    options_.startDeadline = 100ms;
    const Expected<WallRunResult> result = run("trap 'exit 1' TERM; while :; do sleep 0.05; done", "touch $S/started");
    ASSERT_TRUE(result);
    EXPECT_EQ(result->server.value, 1);
    EXPECT_SAID("not ready after 0.1 s");
    EXPECT_FALSE(has("started"));
}

TEST_F(WallRunning, GoesOnWithoutAClientThatIsKilled) {
    const Expected<WallRunResult> result = run(std::string(kListen) + "await $S/over; exit 0", R"(
        if [ $host = a ]; then kill -9 $$; fi
        sleep 0.2; touch $S/over; exit 0)");
    ASSERT_TRUE(result);
    EXPECT_TRUE(result->server.good());
    EXPECT_FALSE(result->deserted);
    EXPECT_SAID("client of host a (pid ");
    EXPECT_SAID("was killed by signal 9 (Killed)\n");
    EXPECT_TRUE(result->restarts.empty());
}

TEST_F(WallRunning, StartsADeadClientAgainIfAsked) {
    options_.restart = true;
    const Expected<WallRunResult> result = run(std::string(kListen) + "await $S/again; exit 0", R"(
        if [ $host = a ]; then
          if [ -e $S/died ]; then touch $S/again; exit 0; fi
          touch $S/died; kill -9 $$
        fi
        await $S/again; exit 0)");
    ASSERT_TRUE(result);
    EXPECT_TRUE(result->server.good());
    EXPECT_EQ(result->restarts, (std::map<std::string, int>{{"a", 1}}));
    EXPECT_SAID("it is started again");
}

TEST_F(WallRunning, NamesAClientThatLeavesAWallThatGoesOn) {
    options_.leaveGrace = 200ms;
    const std::string server =
        std::string(kListen) + "await $S/b; for i in $(seq 60); do [ -e $S/again ] && break; sleep 0.05; done; exit 0";
    const std::string client =
        "[ -e $S/b ] && [ $host = b ] && touch $S/again; touch $S/$host; [ $host = b ] || exec sleep 10";
    options_.finishDeadline = 100ms;
    ASSERT_TRUE(run(server, client));
    EXPECT_SAID("warning: client of host b ended with exit code 0, and the wall goes on\n");
    EXPECT_FALSE(has("again"));
    options_.restart = true;
    std::filesystem::remove(folder_ / "b");
    const Expected<WallRunResult> result = run(server, client);
    ASSERT_TRUE(result);
    EXPECT_SAID("client of host b ended with exit code 0, and the wall goes on; it is started again");
    EXPECT_TRUE(has("again"));
}

TEST_F(WallRunning, StopsAServerThatAllHaveLeft) {
    options_.leaveGrace = 200ms;
    const Expected<WallRunResult> result =
        run(std::string(kListen) + "trap 'exit 0' TERM; while :; do sleep 0.05; done", "exit 0");
    ASSERT_TRUE(result);
    EXPECT_TRUE(result->deserted);
    EXPECT_EQ(result->desertedCode, 1);
    EXPECT_SAID("no render host is left; the server is stopped");
}

TEST_F(WallRunning, DoesNotRepeatWhatIsHopeless) {
    options_.restart = true;
    const Expected<WallRunResult> result =
        run(std::string(kListen) + "trap 'exit 0' TERM; while :; do sleep 0.05; done", "exit 2");
    ASSERT_TRUE(result);
    EXPECT_TRUE(result->deserted);
    EXPECT_EQ(result->desertedCode, 2);
    EXPECT_TRUE(result->restarts.empty());
}

TEST_F(WallRunning, GivesUpAClientThatDiesAgainAndAgain) {
    options_.restart = true;
    options_.mostRestarts = 3;
    const Expected<WallRunResult> result =
        run(std::string(kListen) + "trap 'exit 0' TERM; while :; do sleep 0.05; done", "kill -9 $$");
    ASSERT_TRUE(result);
    EXPECT_TRUE(result->deserted);
    EXPECT_EQ(result->restarts.at("a"), 3);
    EXPECT_SAID("started again 3 times and is given up");
}

TEST_F(WallRunning, StopsAServerThatNobodyListensTo) {
    const Expected<WallRunResult> result =
        run(std::string(kListen) + "trap 'touch $S/told; exit 0' TERM; while :; do sleep 0.05; done", "exit 1");
    ASSERT_TRUE(result);
    EXPECT_TRUE(result->deserted);
    EXPECT_EQ(result->desertedCode, 1);
    EXPECT_TRUE(has("told"));
    EXPECT_SAID("no render host is left");
}

TEST_F(WallRunning, EndsInOrderWhenAskedTo) {
    const Expected<WallRunResult> result = run(
        std::string(kListen) + "trap 'touch $S/over; exit 0' TERM; while :; do sleep 0.05; done",
        "touch $S/$host; if [ $host = b ]; then await $S/a; kill -TERM $PPID; fi; await $S/over; touch $S/$host.done");
    ASSERT_TRUE(result);
    EXPECT_TRUE(result->interrupted);
    EXPECT_TRUE(has("a.done"));
    EXPECT_TRUE(has("b.done"));
}

/// Who had not joined yet does not hear of the server's end.
TEST_F(WallRunning, EndsClientsThatHearNothingSoonWhenAskedTo) {
    options_.finishDeadline = 60s;
    options_.leaveDeadline = 100ms;
    const auto before = std::chrono::steady_clock::now();
    const Expected<WallRunResult> result =
        run(std::string(kListen) + "trap 'exit 0' TERM; while :; do sleep 0.05; done",
            "if [ $host = b ]; then kill -TERM $PPID; fi; exec sleep 50");
    ASSERT_TRUE(result);
    EXPECT_TRUE(result->interrupted);
    EXPECT_LT(std::chrono::steady_clock::now() - before, 30s);
}

TEST_F(WallRunning, KillsAServerThatDoesNotEnd) {
    options_.finishDeadline = 100ms;
    const Expected<WallRunResult> result =
        run(std::string(kListen) + "trap '' TERM; while :; do sleep 0.05; done", "exit 1");
    ASSERT_TRUE(result);
    EXPECT_TRUE(result->server.signalled);
    EXPECT_SAID("the server does not end; it is killed");
}

TEST_F(WallRunning, EndsClientsThatOutstayTheServer) {
    options_.finishDeadline = 100ms;
    const Expected<WallRunResult> result = run(std::string(kListen) + "await $S/a; await $S/b; exit 0", R"(
        if [ $host = a ]; then trap '' TERM; fi
        touch $S/$host
        while :; do sleep 0.05; done)");
    ASSERT_TRUE(result);
    EXPECT_TRUE(result->server.good());
    EXPECT_SAID("client of host a (pid ");
    EXPECT_SAID("does not end; it is killed");
    EXPECT_EQ(said().find("client of host b"), std::string::npos) << "a word was enough: " << said();
}

TEST_F(WallRunning, KillsAStoppedClientAtTheEndWithoutWaiting) {
    options_.finishDeadline = 60s;
    const auto before = std::chrono::steady_clock::now();
    const Expected<WallRunResult> result = run(std::string(kListen) + "await $S/b; sleep 0.1; exit 0",
                                               "if [ $host = a ]; then kill -STOP $$; fi; touch $S/b; exit 0");
    ASSERT_TRUE(result);
    EXPECT_SAID("is stopped; it is killed");
    EXPECT_EQ(said().find("was killed by signal"), std::string::npos) << "what we did ourselves is said once";
    EXPECT_LT(std::chrono::steady_clock::now() - before, 30s);
}

TEST_F(WallRunning, EndsClientsAtOnceWhenTheServerHasDied) {
    options_.finishDeadline = 60s;
    const auto before = std::chrono::steady_clock::now();
    const Expected<WallRunResult> result =
        run(std::string(kListen) + "await $S/a; await $S/b; kill -9 $$", "touch $S/$host; exec sleep 30");
    ASSERT_TRUE(result);
    EXPECT_TRUE(result->server.signalled);
    EXPECT_LT(std::chrono::steady_clock::now() - before, 25s);
}

TEST_F(WallRunning, IsNotHeldUpByAProcessThatKeepsAStreamOpen) {
    const auto before = std::chrono::steady_clock::now();
    const Expected<WallRunResult> result =
        run(std::string(kListen) +
                "await $S/a; await $S/b; setsid bash -c 'echo $$ >'$S'/sleeper.part; mv '$S'/sleeper.part "
                "'$S'/sleeper; exec sleep 60' & await $S/sleeper; exit 0",
            "touch $S/$host");
    ASSERT_TRUE(result);
    EXPECT_LT(std::chrono::steady_clock::now() - before, 30s);
    ::kill(std::stoi(read(folder_ / "sleeper")), SIGKILL);
}

TEST_F(WallRunning, ShowsControlCharactersOfChildrenAsQuestionMarks) {
    const Expected<WallRunResult> result = run("printf 'bad \\033[2J line\\n' >&2; exit 3", "exit 0");
    ASSERT_TRUE(result);
    EXPECT_SAID("bad ?[2J line\n");
}

}  // namespace
}  // namespace tessera
