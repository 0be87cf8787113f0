/// A wall whose hosts are started by ssh: a real sshd on loopback, and programs in its place that say odd things.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <filesystem>
#include <optional>

#include "common/base/Version.h"
#include "tests/integration/StartedWall.h"
#include "tests/unit/Eventually.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

class StartedBySsh : public StartedWall {
protected:
    void SetUp() override {
        if (const std::string why = SshServer::whyNot(); !why.empty()) GTEST_SKIP() << why;
        sshd_.emplace(folder_.path());
        ASSERT_TRUE(sshd_->good()) << sshd_->log();
    }
    [[nodiscard]] std::string machine(const std::string& more = "", int port = 0) const {
        return machineAt(*sshd_, more, port);
    }
    std::vector<std::string> command(const std::string& wall, std::vector<std::string> more = {}) {
        return StartedWall::command(*sshd_, wall, std::move(more));
    }

    std::optional<SshServer> sshd_;
};

#define EXPECT_HAS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

TEST_F(StartedBySsh, IsTheWallThatRunsHereAndLeavesNobodyBehind) {
    const std::string wall = wallOf(machine(client()), machine(client()));
    const Outcome there = run(folder_.path(), command(wall, {"--frames", "3"}), 120s);
    EXPECT_EQ(there.exitCode, 0) << there.output << sshd_->log();
    EXPECT_HAS(there.output, "the server listens on 127.0.0.1");
    EXPECT_HAS(there.output, "0 faults");
    // The picture is of a frame at the end; which one, it says.
    const std::size_t said = there.output.find("240x100, frame ");
    ASSERT_NE(said, std::string::npos) << there.output;
    const int frame = std::stoi(there.output.substr(said + 15));
    EXPECT_GE(frame, 2);
    const Outcome here = run(folder_.path(),
                             {program("tessera-wall"), "--wall", wall, "--scene", kYard, "--frames",
                              std::to_string(frame + 1), "--output", folder_.path() + "/here"},
                             120s);
    ASSERT_EQ(here.exitCode, 0) << here.output;
    EXPECT_TRUE(picture(folder_.path() + "/here/wall.png") == picture(folder_.path() + "/out/wall.png"));
    EXPECT_FALSE(fs::exists(folder_.path() + "/out/tiles/front-0-0/shown.frame"))
        << "clients elsewhere have no folder here";
    EXPECT_TRUE(allGone(0ms)) << "who has ended has ended its clients";
}

TEST_F(StartedBySsh, MixesWithHostsThatRunHere) {
    const Outcome mixed = run(folder_.path(), command(wallOf("", machine(client())), {"--frames", "2"}), 120s);
    EXPECT_EQ(mixed.exitCode, 0) << mixed.output;
    EXPECT_EQ(picture(folder_.path() + "/out/wall.png").widthPx, 240);
    EXPECT_TRUE(allGone(0ms));
}

TEST_F(StartedBySsh, EndsWithALauncherThatIsKilled) {
    // Nobody takes away the keys of a run that is killed.
    std::vector<std::string> started = {"/usr/bin/env", "TMPDIR=" + folder_.path()};
    for (std::string& word : command(wallOf(machine(client()), machine(client())), {"--verbose"}))
        started.push_back(std::move(word));
    Process wall(folder_.path(), "wall", std::move(started));
    ASSERT_TRUE(wall.waitForText("role client host east", 60s)) << wall.output();
    EXPECT_TRUE(eventually([] { return clientsWith("--while-input").size() >= 2; })) << wall.output();
    EXPECT_EQ(clientsWith("--while-input").size(), 2u) << wall.output();
    wall.signal(SIGKILL);
    EXPECT_TRUE(allGone(10s));
}

TEST_F(StartedBySsh, SaysWhoIsLostWhenConnectionsAreCutAndStartsThemAgain) {
    Process wall(folder_.path(), "wall",
                 command(wallOf(machine(client()), machine(client())), {"--restart", "--verbose"}));
    ASSERT_TRUE(wall.waitForText("role client host east", 60s)) << wall.output();
    EXPECT_TRUE(eventually([] { return clientsWith("--while-input").size() >= 2; })) << wall.output();
    const std::vector<pid_t> before = clientsWith("--while-input");
    sshd_->cutAll();
    EXPECT_TRUE(wall.waitForText("client of host west is lost: the connection to", 20s)) << wall.output();
    EXPECT_TRUE(wall.waitForText("client of host east is lost: the connection to", 20s)) << wall.output();
    const auto renewed = [&] {
        const std::vector<pid_t> now = clientsWith("--while-input");
        return now.size() == 2 &&
               std::ranges::none_of(now, [&](pid_t pid) { return std::ranges::find(before, pid) != before.end(); });
    };
    EXPECT_TRUE(eventually(renewed, 30s)) << wall.output();
    wall.signal(SIGINT);
    EXPECT_EQ(wall.waitForExit(60s), 0) << wall.output();
    EXPECT_TRUE(allGone(0ms)) << wall.output();
}

TEST_F(StartedBySsh, SaysWhatEachMachineLacksBeforeAnythingIsStarted) {
    const auto lacks = [&](const std::string& left, const std::string& right, const std::string& ssh) {
        std::vector<std::string> words = command(wallOf(left, right), {"--frames", "2"});
        *std::ranges::find(words, sshd_->client()) = ssh;
        const Outcome outcome = run(folder_.path(), words, 100s);
        EXPECT_EQ(outcome.exitCode, 1) << outcome.output;
        EXPECT_EQ(outcome.output.find("role server"), std::string::npos) << outcome.output;
        EXPECT_HAS(outcome.output, "--start-anyway");
        return outcome.output;
    };
    const std::string good = sshd_->client();
    const std::string two = lacks(machine(client("/nowhere/tessera-client")), machine(client(), closedPort()), good);
    EXPECT_HAS(two, "host west on " + me() + "@127.0.0.1: there is no `/nowhere/tessera-client`");
    EXPECT_HAS(two, "host east on " + me() + "@127.0.0.1: no ssh server answers there");
    EXPECT_HAS(two, "2 of 2 hosts");
    EXPECT_HAS(lacks(machine(client()), "", sshd_->strangersClient()), "permission denied");
    EXPECT_HAS(lacks(machine(client()), "", sshd_->newcomersClient()), "its host key is not known here: say `ssh -p");
    // Programs that are something else.
    const auto script = [&](const std::string& name, const std::string& text) {
        const std::string path = folder_.write(name, "#!/bin/sh\n" + text + "\n");
        fs::permissions(path, fs::perms::owner_all);
        return client(path);
    };
    const std::string other = lacks(machine(script("older", "echo 'tessera-client 0.0.9 (protocol 1)'")),
                                    machine(script("garbage", "head -c 3000 /dev/urandom; exit 3")), good);
    EXPECT_HAS(other, "is \"tessera-client 0.0.9 (protocol 1)\" and not " + versionText("tessera-client"));
    EXPECT_HAS(other, "host east");
    const std::string flood =
        lacks(machine(script("flood", "yes 'I am not a client'")), machine(script("unrunnable", "x")), good);
    EXPECT_HAS(flood, "talks without end");
    const std::string windows =
        lacks(machine(client() +
                      " display: \":977\" args: \"--window\" environment { name: \"SDL_VIDEODRIVER\" value: \"x11\" }"),
              machine(client() + " args: \"--surface\" args: \"egl\" args: \"--device\" args: \"63\""), good);
    EXPECT_HAS(windows, "host west");
    EXPECT_HAS(windows, "display");
    EXPECT_HAS(windows, "device");
}

TEST_F(StartedBySsh, GoesOnWithoutAMachineIfThatIsWanted) {
    const Outcome outcome = run(
        folder_.path(),
        command(wallOf(machine(client()), machine(client(), closedPort())), {"--frames", "2", "--start-anyway"}), 120s);
    EXPECT_EQ(outcome.exitCode, 0) << outcome.output;
    EXPECT_HAS(outcome.output, "no ssh server answers there");
    EXPECT_HAS(outcome.output, "nobody draws front-1-0");
    EXPECT_EQ(picture(folder_.path() + "/out/wall.png").widthPx, 240);
}

TEST_F(StartedBySsh, QuotesWhatTheWallFileSays) {
    // Everything that a shell could take for itself, in a variable and an argument: the program there must get it
    // letter by letter.
    const std::string odd = R"(a b  'c' "d" $HOME `id` \\ ; & | > /tmp/x * ? ~ # ! {e,f} (g) %s ü)";
    const std::string path =
        folder_.write("echo", fmt::format("#!/bin/bash\nprintf '%s\\n' \"$ODD\" >'{0}/variable'\nfor a; do printf "
                                          "'%s\\n' \"$a\"; done >'{0}/arguments'\nexec {1} \"${{@:1:1}}\"\n",
                                          folder_.path(), program("tessera-client")));
    fs::permissions(path, fs::perms::owner_all);
    std::string escaped;
    for (const char c : odd) escaped += (c == '"' || c == '\\') ? std::string("\\") + c : std::string(1, c);
    (void)run(
        folder_.path(),
        command(wallOf(machine(client(path) +
                               fmt::format(" environment {{ name: \"ODD\" value: \"{0}\" }} args: \"{0}\"", escaped)),
                       ""),
                {"--frames", "1"}),
        100s);
    EXPECT_EQ(readText(folder_.path() + "/variable"), odd + "\n");
    EXPECT_HAS(readText(folder_.path() + "/arguments"), odd + "\n");
}

TEST_F(StartedBySsh, CutsAFloodOfWordsAndNamesWhoSaysThem) {
    const std::string path = folder_.write(
        "talker",
        fmt::format(
            "#!/bin/bash\ncase \" $* \" in *--check*|*--version*) exec {0} \"$@\";; esac\n"
            "(for i in $(seq 20000); do echo \"word $i\"; done; printf 'bad \\033[2J word\\n') >&2\nexec {0} \"$@\"\n",
            program("tessera-client")));
    fs::permissions(path, fs::perms::owner_all);
    const Outcome outcome = run(folder_.path(), command(wallOf("", machine(client(path))), {"--frames", "2"}), 120s);
    EXPECT_EQ(outcome.exitCode, 0) << outcome.output.substr(0, 4000);
    EXPECT_HAS(outcome.output, "[east] word 1\n");
    EXPECT_HAS(outcome.output, "host east talks too much: ");
    EXPECT_LT(outcome.output.size(), 200'000u);
    EXPECT_EQ(outcome.output.find('\033'), std::string::npos);
}

/// The client's own part, without ssh: whoever holds its input.
TEST(ClientOnALifeLine, EndsWhenItsInputEndsOrFallsSilent) {
    TemporaryFolder folder;
    const auto ends = [&](const std::string& input, const std::string& why) {
        const Outcome outcome =
            run(folder.path(),
                {"/bin/bash", "-c",
                 fmt::format(
                     "{} | {} --server 127.0.0.1:{} --host a --surface none --while-input 1; exit ${{PIPESTATUS[1]}}",
                     input, program("tessera-client"), closedPort())},
                30s);
        EXPECT_EQ(outcome.exitCode, 4) << outcome.output;
        EXPECT_HAS(outcome.output, why);
    };
    ends("sleep 0.2", "is gone: it ends");
    ends("for i in 1 2 3 4 5; do echo; sleep 0.5; done", "is gone: it ends");
    ends("(exec sleep 3)", "has been silent for 1 s: it ends");
}

}  // namespace
}  // namespace tessera::test
