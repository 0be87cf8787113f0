/// Hosts on machines of their own: what ssh is told, what its words mean, how their clients are followed. The real sshd
/// stands in tests/integration/StartTest.cpp; here a script plays ssh, and runs what it is given.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <chrono>
#include <random>

#include "common/base/Version.h"
#include "common/net/OwnAddress.h"
#include "deploy/wall/Machines.h"
#include "deploy/wall/OwnAddress.h"
#include "deploy/wall/RemoteWall.h"
#include "deploy/wall/Ssh.h"
#include "deploy/wall/WallRun.h"
#include "tests/support/words/Words.h"
#include "tests/unit/launcher/Stage.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;

class RemoteHosts : public test::Stage {
protected:
    /// What stands in ssh's place: does what the last of its words says, here.
    std::string honestSsh() {
        return program("ssh", "for last; do :; done\nexport SSH_CONNECTION='127.0.0.1 1 127.0.0.1 2'\neval \"$last\"");
    }
    std::optional<MachineAnswer> ask(const std::string& ssh, const Machine& machine,
                                     std::chrono::milliseconds deadline = 10s) {
        Expected<Signals> signals = Signals::take();
        const auto answers =
            askMachines({{.host = "west", .machine = machine, .arguments = {"--surface", "none"}}},
                        {.ssh = ssh, .version = versionText("tessera-client"), .deadline = deadline}, *signals);
        return answers ? std::optional(answers->front()) : std::nullopt;
    }
    std::string lackOf(const std::string& ssh, const Machine& machine, std::chrono::milliseconds deadline = 10s) {
        const auto answer = ask(ssh, machine, deadline);
        return !answer || answer->lacks.empty() ? "" : answer->lacks.front();
    }
};

// A failing seed: TESSERA_SEED=N build/bin/unit_launcher --gtest_filter='*AnyText*'.
TEST_F(RemoteHosts, AnyTextIsOneWordOfAShell) {
    const char* one = std::getenv("TESSERA_SEED");
    const unsigned first = one ? static_cast<unsigned>(std::stoul(one)) : 1;
    for (unsigned seed = first; seed < first + (one ? 1 : 25); ++seed) {
        SCOPED_TRACE(fmt::format("TESSERA_SEED={} build/bin/unit_launcher --gtest_filter='*AnyText*'", seed));
        std::mt19937 random(seed);
        std::string text;
        for (int i = 0; i < 60; ++i)
            text.push_back(static_cast<char>(std::uniform_int_distribution(0x20, 0x7e)(random)));
        text += "'\"\\$`!";
        // Twice, as it goes through the account's shell and sh.
        const std::string script = "printf %s " + shellWord(text);
        Expected<Child> child =
            Child::start({.program = "/bin/sh", .arguments = {"-c", "exec sh -c " + shellWord(script)}});
        ASSERT_TRUE(child);
        std::string said;
        while (child->handle(Child::kOut) >= 0)
            for (const std::string& line : child->readLines(Child::kOut)) said += line;
        EXPECT_EQ(said, text);
    }
}

TEST_F(RemoteHosts, AreAskedWithoutPasswordsTunnelsOrOthersConnections) {
    const ChildCommand command = overSsh("/usr/bin/ssh", {.ssh = "me@wall-3", .port = 2222}, "true");
    const std::string all = fmt::format("{}", fmt::join(command.arguments, "|"));
    for (const char* part : {"BatchMode=yes", "ConnectTimeout=", "ServerAliveInterval=", "ControlPath=none",
                             "ClearAllForwardings=yes", "-p|2222|--|me@wall-3|exec sh -c 'true'"})
        EXPECT_NE(all.find(part), std::string::npos) << part << " in " << all;
    EXPECT_TRUE(command.feedInput);
}

TEST_F(RemoteHosts, ThatAreReadySayByWhichAddressTheySeeUsAndWhatTheyHave) {
    const std::string client = program("client", fmt::format(R"(
        [ "$1" = --version ] && {{ echo '{}'; exit 0; }}
        echo "check: cores 12"; echo "check: pixels 00ff"; echo "$@" $DISPLAY $EXTRA >$S/asked; exit 0)",
                                                             versionText("tessera-client")));
    const auto answer =
        ask(honestSsh(), {.ssh = "wall-3", .command = client, .display = ":7", .environment = {{"EXTRA", "it's"}}});
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->lacks, std::vector<std::string>());
    EXPECT_EQ(answer->seesUsAs, "127.0.0.1");
    EXPECT_EQ(answer->cores, 12);
    EXPECT_EQ(answer->pixels, "00ff");
    EXPECT_EQ(read(folder_ / "asked"), "--surface none --check :7 it's\n");
}

TEST_F(RemoteHosts, SayWhatIsInTheWayInWords) {
    const auto ssh = [&](const std::string& words, int code = 255) {
        return program("odd-ssh", fmt::format("printf '{}\\r\\n' >&2; exit {}", words, code));
    };
    const Machine machine{.ssh = "me@wall-3", .port = 2222};
    EXPECT_WORDS(lackOf(ssh("ssh: Could not resolve hostname wall-3: Name or service not known"), machine));
    EXPECT_WORDS(lackOf(ssh("ssh: connect to host wall-3 port 2222: Connection timed out"), machine));
    EXPECT_WORDS(lackOf(ssh("ssh: connect to host wall-3 port 2222: No route to host"), machine));
    EXPECT_WORDS(lackOf(ssh("ssh: connect to host wall-3 port 2222: Connection refused"), machine));
    EXPECT_WORDS(lackOf(ssh("Host key verification failed."), machine));
    EXPECT_WORDS(
        lackOf(ssh("@  WARNING: REMOTE HOST IDENTIFICATION HAS CHANGED!  @\\nHost key verification failed."), machine));
    EXPECT_WORDS(lackOf(ssh("me@wall-3: Permission denied (publickey,password)."), machine));
    EXPECT_WORDS(lackOf(ssh("something new"), machine));
    EXPECT_EQ(lackOf(ssh("x"), machine).find('\r'), std::string::npos);
    EXPECT_WORDS(lackOf(program("quiet", "exit 0"), machine));
    EXPECT_WORDS(lackOf(program("nologin", "echo 'This account is currently not available.'; exit 1"), machine));
    EXPECT_WORDS(lackOf((folder_ / "none").string(), machine));
}

TEST_F(RemoteHosts, WhoseProgramsAreSomethingElseLackAClient) {
    const std::string ssh = honestSsh();
    const auto with = [&](const std::string& script, std::chrono::milliseconds deadline = 10s) {
        return lackOf(ssh, {.ssh = "wall-3", .command = program("client", script)}, deadline);
    };
    EXPECT_WORDS(lackOf(ssh, {.ssh = "wall-3", .command = "/no/such"}));
    EXPECT_WORDS(lackOf(ssh, {.ssh = "wall-3", .command = folder_.string()}));
    EXPECT_WORDS(with("echo tessera-client 9"));
    EXPECT_WORDS(with("exit 0"));
    EXPECT_WORDS(with("while :; do echo; done"));
    EXPECT_WORDS(with("while :; do echo >&2; done"));
    EXPECT_WORDS(with("cat /dev/zero"));
    EXPECT_WORDS(with("exec sleep 30", 300ms));
    EXPECT_NE(with("head -c 5000 /dev/urandom").find("both have to be of one version"), std::string::npos);
    const std::string good =
        fmt::format("[ \"$1\" = --version ] && {{ echo '{}'; exit 0; }}\n", versionText("tessera-client"));
    EXPECT_EQ(with(good + "echo 'check: trouble a display'; exit 1"), "a display");
    EXPECT_WORDS(with(good + "echo 'boom' >&2; exit 134"));
}

TEST_F(RemoteHosts, OwnArgumentsCountMoreThanTheWallsOwn) {
    using Words = std::vector<std::string>;
    EXPECT_EQ(mergedArguments({"--surface", "egl", "--window", "DP-1", "--full-screen"},
                              {"--surface", "osmesa", "--window", "--share=off", "--device", "1"}),
              (Words{"--surface", "egl", "--window", "DP-1", "--full-screen", "--share=off", "--device", "1"}));
    EXPECT_EQ(mergedArguments({"--device=2"}, {"--device", "1", "--share", "off"}),
              (Words{"--device=2", "--share", "off"}));
    EXPECT_EQ(mergedArguments({}, {"--device", "1"}), (Words{"--device", "1"}));
}

TEST_F(RemoteHosts, AreAskedForTheMonitorsThatTheWallNames) {
    using Words = std::vector<std::string>;
    Wall wall;
    wall.screens = {Screen{.name = "s"}};
    wall.screens[0].grid.columns = 3;
    const auto tile = [](int column, Eye eye, const std::string& monitor) {
        TileAssignment made{.screen = "s", .column = column, .eye = eye};
        made.output.monitor = monitor;
        return made;
    };
    wall.hosts = {{.name = "a",
                   .tiles = {tile(0, Eye::kLeft, "DP-1"), tile(0, Eye::kRight, ""), tile(1, Eye::kCenter, ""),
                             tile(2, Eye::kCenter, "DP-3")}},
                  {.name = "b", .tiles = {tile(0, Eye::kCenter, "--device")}}};
    wall.hosts[0].tiles[0].output.stereo = StereoPacking::kRows;
    const auto asked = [&](Words words) { return withMonitorsOf(wall, "a", std::move(words)); };
    EXPECT_EQ(asked({"--window", "--full-screen"}), (Words{"--window", "DP-1", "DP-3", "--full-screen"}));
    EXPECT_EQ(asked({"--vsync", "--window"}), (Words{"--vsync", "--window", "DP-1", "DP-3"}));
    // The command line wins over the wall, output by output.
    EXPECT_EQ(asked({"--window", "0", "--vsync"}), (Words{"--window", "0", "DP-3", "--vsync"}));
    EXPECT_EQ(asked({"--window=0", "1", "2"}), (Words{"--window=0", "1", "2"}));
    EXPECT_EQ(asked({"--window=0", "1"}), (Words{"--window=0", "1", "DP-3"}));
    EXPECT_EQ(asked({"--surface", "egl"}), (Words{"--surface", "egl"})) << "no windows";
    EXPECT_EQ(withMonitorsOf(wall, "b", {"--window"}), (Words{"--window"})) << "no name becomes an option";
}

TEST_F(RemoteHosts, ReachTheServerWhereItListens) {
    EXPECT_TRUE(isOwnAddress("127.0.0.1"));
    EXPECT_FALSE(isOwnAddress("192.0.2.1"));
    EXPECT_FALSE(isOwnAddress("wall-3"));
    EXPECT_EQ(addressTowards("127.0.0.1"), "127.0.0.1");
    EXPECT_EQ(chooseAddresses({"10.0.0.1", "10.0.0.1"}).listen, "10.0.0.1:0");
    const ServerAddresses two = chooseAddresses({"10.0.0.1", "10.1.0.1"});
    EXPECT_EQ(two.listen, "0.0.0.0:0");
    EXPECT_EQ(two.dial, (std::vector<std::string>{"10.0.0.1", "10.1.0.1"}));
    const ServerAddresses six = chooseAddresses({"fd00::1", "10.1.0.1"});
    EXPECT_EQ(six.listen, "[::]:0");
    EXPECT_EQ(six.dial[0], "[fd00::1]");
    EXPECT_EQ(chooseAddresses({}).listen, "127.0.0.1:0");
}

class RemoteRunning : public test::Stage {
protected:
    Expected<WallRunResult> run(const std::string& server, const std::string& client, bool lacking = false) {
        options_.serverProgram = program("server", server);
        options_.clientProgram = "/no/local/client";
        options_.hosts = {"west"};
        const std::string ssh = program("ssh", client);
        options_.remote["west"] = {.destination = "me@wall-3",
                                   .command =
                                       [ssh](const std::string& port) {
                                           return ChildCommand{.program = ssh, .arguments = {port}, .feedInput = true};
                                       },
                                   .lacking = lacking};
        Expected<Signals> signals = Signals::take();
        return runWall(options_, *signals, console());
    }
    WallRunOptions options_{.startDeadline = 10s, .finishDeadline = 5s, .killAfter = 300ms, .restartDelay = 20ms};
    static constexpr const char* kListen = "echo 'tessera-server: listening on 0.0.0.0:4711'\n";
};

TEST_F(RemoteRunning, IsToldThePortAndFedSignsOfLife) {
    const auto result = run(std::string(kListen) + "await $S/fed; exit 0",
                            "echo $1 >$S/port; read -r x && read -r x && touch $S/fed; cat >/dev/null; exit 0");
    ASSERT_TRUE(result) << result.error().message;
    EXPECT_TRUE(result->server.good());
    EXPECT_EQ(read(folder_ / "port"), "4711\n");
    EXPECT_TRUE(has("fed"));
}

TEST_F(RemoteRunning, EndsByItsInputAndNotByASignalToSsh) {
    options_.finishDeadline = 100ms;
    const auto result = run(std::string(kListen) + "await $S/started; exit 0",
                            "trap 'touch $S/signalled; exit 1' TERM\ntouch $S/started; while read -r x; do :; done; "
                            "touch $S/ended; exit 0");
    ASSERT_TRUE(result);
    EXPECT_TRUE(has("ended"));
    EXPECT_FALSE(has("signalled"));
}

TEST_F(RemoteRunning, EndsOfConnectionsAndClientsAreToldApart) {
    const auto said = [&](int code) {
        const auto result = run(std::string(kListen) + "trap 'exit 0' TERM; while :; do sleep 0.05; done",
                                fmt::format("exit {}", code));
        EXPECT_EQ(result->desertedCode, code == 255 ? 4 : 1);
        return this->said();
    };
    EXPECT_NE(said(255).find("client of host west is lost: the connection to me@wall-3 has ended"), std::string::npos);
    EXPECT_NE(said(137).find("client of host west was killed on me@wall-3 by signal 9 (Killed)"), std::string::npos);
    EXPECT_NE(said(1).find("client of host west ended with exit code 1"), std::string::npos);
}

TEST_F(RemoteRunning, IsTriedAgainLaterEachTime) {
    options_.restart = true;
    options_.mostRestarts = 4;
    options_.restartDelay = 40ms;
    options_.longestRestartDelay = 200ms;
    const auto begin = std::chrono::steady_clock::now();
    const auto result =
        run(std::string(kListen) + "trap 'exit 0' TERM; while :; do sleep 0.05; done", "echo >>$S/tries; exit 255");
    ASSERT_TRUE(result);
    EXPECT_EQ(read(folder_ / "tries"), "\n\n\n\n\n");
    EXPECT_GE(std::chrono::steady_clock::now() - begin, 480ms) << "40 + 80 + 160 + 200";
    EXPECT_SAID("started again 4 times and is given up");
}

TEST_F(RemoteRunning, ThatLacksSomethingIsLeftAloneOrTriedLater) {
    options_.restart = true;
    const auto result =
        run(std::string(kListen) + "await $S/tried; exit 0", "touch $S/tried; cat >/dev/null; exit 0", true);
    ASSERT_TRUE(result);
    EXPECT_TRUE(result->server.good());
    options_.restart = false;
    const auto alone =
        run(std::string(kListen) + "trap 'exit 0' TERM; while :; do sleep 0.05; done", "touch $S/again", true);
    ASSERT_TRUE(alone);
    EXPECT_TRUE(alone->deserted) << "nobody else was there";
    EXPECT_FALSE(has("again"));
}

TEST_F(RemoteRunning, TakesThePictureBeforeTheServerIsToldToEnd) {
    options_.endAfterFrames = 3;
    options_.beforeEnd = [this](const std::string& address) {
        return ChildCommand{.program = program("ctl", "[ -e $S/told ] || echo $1 >$S/picture; echo 'a picture'"),
                            .arguments = {address}};
    };
    const auto result = run(std::string(kListen) +
                                "trap 'touch $S/told; exit 0' TERM; for i in 1 2 3 4; do echo progress $i 0; done; "
                                "while :; do sleep 0.05; done",
                            "cat >/dev/null; exit 0");
    ASSERT_TRUE(result);
    EXPECT_TRUE(result->server.good());
    EXPECT_EQ(read(folder_ / "picture"), "0.0.0.0:4711\n");
    EXPECT_SAID("a picture\n");
    EXPECT_SAID("3 of 3 frames\n");
}

TEST_F(RemoteRunning, DoesNotWaitForAPictureForEver) {
    options_.endAfterFrames = 1;
    options_.beforeEndDeadline = 200ms;
    options_.beforeEnd = [this](const std::string&) {
        return ChildCommand{.program = program("ctl", "exec sleep 60")};
    };
    const auto result =
        run(std::string(kListen) + "trap 'exit 0' TERM; echo progress 1 0; while :; do sleep 0.05; done",
            "cat >/dev/null; exit 0");
    ASSERT_TRUE(result);
    EXPECT_TRUE(result->server.good());
}

TEST_F(RemoteRunning, FloodsAreCutAndLinesNamed) {
    options_.mostLinesPerSecond = 10;
    const auto result = run(std::string(kListen) + "await $S/said; sleep 1.2; exit 0",
                            "echo hello; echo 'tessera-client[west]: joined' >&2; for i in $(seq 500); do echo line "
                            "$i; done; touch $S/said; cat >/dev/null; exit 0");
    ASSERT_TRUE(result);
    EXPECT_SAID("[west] hello\n");
    EXPECT_SAID("\ntessera-client[west]: joined\n");
    EXPECT_SAID("host west talks too much: ");
    EXPECT_LT(said().size(), 3000u);
}

TEST_F(RemoteRunning, FloodsWithoutLineBreaksAreCutToo) {
    options_.mostLinesPerSecond = 10;
    const auto result = run(std::string(kListen) + "await $S/said; sleep 1.2; exit 0",
                            "head -c 4000000 /dev/zero | tr '\\0' x; touch $S/said; cat >/dev/null; exit 0");
    ASSERT_TRUE(result);
    EXPECT_SAID("host west talks too much: ");
    EXPECT_LT(said().size(), 100'000u);
}

}  // namespace
}  // namespace tessera
