/// Each wrong file, wall or option gives one clear message and the right exit code.
#include <gtest/gtest.h>
#include <sched.h>
#include <seccomp.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>

#include "tests/integration/ThreadWall.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;

class BadInput : public testing::Test {
protected:
    void expect(const std::string& name, std::vector<std::string> options, int exitCode,
                const std::vector<std::string>& says) {
        options.insert(options.begin(), {"--frames", "1"});
        const TemporaryFolder said;
        ThreadServer server(said.path(), options);
        const std::optional<int> exit = server.waitForExit(60s);
        const std::string output = server.output();
        EXPECT_EQ(exit, exitCode) << name << "\n" << output;
        EXPECT_NE(output.find("tessera-server: "), std::string::npos) << name << "\n" << output;
        for (const std::string& part : says)
            EXPECT_NE(output.find(part), std::string::npos) << name << ": expected '" << part << "' in\n" << output;
    }
    void expectScene(const std::string& file, const std::string& content, const std::vector<std::string>& says) {
        const std::string path = folder_.write(file, content);
        std::vector<std::string> all = says;
        all.push_back(file);
        expect(file, {"--wall", "1x1", "--scene", path}, 3, all);
    }
    void expectWall(const std::string& name, const std::string& content, const std::vector<std::string>& says) {
        const std::string path = folder_.write(name + ".wall", content);
        expect(name, {"--wall", path, "--scene", kYard}, 3, says);
    }
    TemporaryFolder folder_;
};

const char* const kGoodWall = R"(
screens { name: "front" lower_left { x: -1.6 y: 0.6 } lower_right { x: 1.6 y: 0.6 } upper_left { x: -1.6 y: 2.4 }
  grid { columns: 2 rows: 1 tile_width_px: 64 tile_height_px: 72 } }
users { name: "viewer" position { y: 1.7 z: 2.4 } }
hosts { name: "left" tiles { screen: "front" column: 0 row: 0 user: "viewer" } }
hosts { name: "right" tiles { screen: "front" column: 1 row: 0 user: "viewer" } }
)";
std::string changed(const std::string& from, const std::string& to) {
    std::string wall = kGoodWall;
    const std::size_t at = wall.find(from);
    EXPECT_NE(at, std::string::npos);
    return wall.replace(at, from.size(), to);
}

TEST_F(BadInput, Scenes) {
    expect("missing", {"--scene", folder_.path() + "/nowhere.glb"}, 3, {"nowhere.glb"});
    expectScene("empty.glb", "", {});
    expectScene("garbage.glb", "this is no model at all, whatever its name says", {});
    expectScene("garbage.obj", std::string(5000, '\x01'), {});
    expectScene("open.tsct", "node { name: \"a\" ", {":1:"});
    expectScene("unknown.tsct", "node { name: \"a\"\n  bxo { size { x: 1 } } }", {":2:", "bxo"});
    expectScene("asset.tsct", "node { import { uri: \"asset://no/such.glb\" } }", {"no/such.glb"});
    mkfifo((folder_.path() + "/pipe.glb").c_str(), 0600);
    expect("fifo", {"--scene", folder_.path() + "/pipe.glb"}, 3, {"pipe.glb"});
    expect("folder", {"--scene", folder_.path()}, 3, {folder_.path()});
}

TEST_F(BadInput, ATruncatedModelIsNamed) {
    const std::string model = "/usr/share/assimp/models/glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb";
    const std::string whole = readText(model);
    if (whole.empty()) GTEST_SKIP() << "assimp-testmodels is not installed";
    expectScene("half.glb", whole.substr(0, whole.size() / 2), {});
}

TEST_F(BadInput, AFileThatReachesOutOfItsFolderIsRefused) {
    expectScene("reach.gltf",
                R"({"asset":{"version":"2.0"},"buffers":[{"uri":"../../../../../../etc/passwd","byteLength":40}],
                    "bufferViews":[{"buffer":0,"byteLength":36}],
                    "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],
                    "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"nodes":[{"mesh":0}],
                    "scenes":[{"nodes":[0]}]})",
                {});
}

TEST_F(BadInput, Walls) {
    expect("no such wall", {"--wall", "9x9", "--scene", kYard}, 3, {"9x9", "2x2"});
    expectWall("unknown-key", changed("columns: 2", "colums: 2"), {":3:", "colums", "columns"});
    expectWall("swapped-corners",
               changed("lower_left { x: -1.6 y: 0.6 } lower_right { x: 1.6 y: 0.6 }",
                       "lower_left { x: 1.6 y: 0.6 } lower_right { x: -1.6 y: 0.6 }"),
               {"front"});
    expectWall("millimetres",
               "screens { name: \"front\" lower_left { x: -1600 y: 600 } lower_right { x: 1600 y: 600 } upper_left { "
               "x: -1600 y: 2400 }\n"
               "  grid { columns: 1 rows: 1 tile_width_px: 64 tile_height_px: 36 } }\n"
               "users { name: \"viewer\" position { y: 1700 z: 2400 } }\n"
               "hosts { name: \"all\" tiles { screen: \"front\" user: \"viewer\" } }\n",
               {"millimet"});
    expectWall("tile-twice", changed("column: 1 row: 0", "column: 0 row: 0"), {"front"});
    expectWall("unknown-user", changed("row: 0 user: \"viewer\"", "row: 0 user: \"nobody\""), {"nobody", "viewer"});
    expectWall("empty", "", {});
}

TEST_F(BadInput, Options) {
    expect("size", {"--size", "12by7", "--scene", kYard}, 2, {"12by7"});
    expect("huge size", {"--size", "4294967360x4294967360", "--scene", kYard}, 2, {"4294967360x4294967360"});
    expect("address", {"--listen", "nonsense", "--scene", kYard}, 2, {"nonsense"});
    expect("camera", {"--wall", "1x1", "--scene", kYard, "--camera", "/no/such"}, 3, {"camera"});
}

TEST_F(BadInput, AnUnknownOptionIsNamed) {
    const Refused refused = refusedWords({"--wal", "1x1"});
    EXPECT_EQ(refused.exitCode, 2);
    EXPECT_NE(refused.words.find("--wal"), std::string::npos) << refused.words;
}

TEST_F(BadInput, WhereTheKernelHasNoLandlockAWallRunsAndNoFileIsRead) {
    const std::string model = folder_.write("model.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    // For this fork and all that it starts there is no Landlock.
    const pid_t pid = ::fork();
    if (pid == 0) {
        ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
        const scmp_filter_ctx filter = seccomp_init(SCMP_ACT_ALLOW);
        seccomp_rule_add(filter, SCMP_ACT_ERRNO(ENOSYS), SYS_landlock_create_ruleset, 0);
        if (seccomp_load(filter) != 0) ::_exit(9);
        Process server(folder_.path(), "server",
                       {program("tessera-server"), "--wall", "1x1", "--size", "160x90", "--allow", folder_.path()});
        const std::string address = server.waitForText("listening on ", 20s).value_or("");
        Process client(folder_.path(), "all",
                       {program("tessera-client"), "--server", address, "--host", "all", "--surface", "none"});
        const Outcome told = run(folder_.path(), {program("tessera-ctl"), "--server", address, "load", model}, 60s);
        const Outcome status = run(folder_.path(), {program("tessera-ctl"), "--server", address, "status"}, 60s);
        const bool warned =
            server.output().find("this kernel has no Landlock, or has it switched off: no file is read") !=
            std::string::npos;
        const bool refused =
            told.exitCode != 0 &&
            told.output.find("this system cannot confine the importer, so the file was not read") != std::string::npos;
        if (!warned || !refused || status.exitCode != 0)
            std::fprintf(stderr, "%s%s%s", server.output().c_str(), told.output.c_str(), status.output.c_str());
        server.signal(SIGTERM);
        const bool ended = server.waitForExit(20s) == 0;
        (void)client.waitForExit(20s);
        ::_exit(warned && refused && status.exitCode == 0 && ended ? 0 : 1);
    }
    int outcome = 0;
    ::waitpid(pid, &outcome, 0);
    EXPECT_EQ(outcome, 0);
}

TEST_F(BadInput, WhereNoThreadCanStartEachProgramSaysSo) {
    const std::string output = folder_.path() + "/out";
    const std::vector<std::vector<std::string>> commands{
        {program("tessera-server"), "--wall", "1x1", "--scene", kYard},
        {program("tessera-client"), "--server", "127.0.0.1:1", "--host", "all", "--surface", "none"},
        {program("tessera-ctl"), "--server", "127.0.0.1:1", "status"},
        {program("tessera-wall"), "--wall", "1x1", "--scene", kYard, "--frames", "1", "--output", output}};
    const pid_t pid = ::fork();
    if (pid == 0) {
        // This fork and all that it starts may begin processes, and no thread. A filter cannot see what clone3 asks
        // for.
        ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
        const scmp_filter_ctx filter = seccomp_init(SCMP_ACT_ALLOW);
        seccomp_rule_add(filter, SCMP_ACT_ERRNO(ENOSYS), SCMP_SYS(clone3), 0);
        seccomp_rule_add(filter, SCMP_ACT_ERRNO(EAGAIN), SCMP_SYS(clone), 1,
                         SCMP_A0(SCMP_CMP_MASKED_EQ, CLONE_THREAD, CLONE_THREAD));
        if (seccomp_load(filter) != 0) ::_exit(9);
        int wrong = 0;
        for (const std::vector<std::string>& command : commands) {
            const Outcome told = run(folder_.path(), command, 60s);
            if (told.exitCode == 1 && told.output.find("the machine has no room for it: ") != std::string::npos)
                continue;
            std::fprintf(stderr, "%s: exit code %d: %s", command[0].c_str(), told.exitCode, told.output.c_str());
            ++wrong;
        }
        ::_exit(wrong);
    }
    int outcome = 0;
    ::waitpid(pid, &outcome, 0);
    EXPECT_EQ(outcome, 0);
}

TEST_F(BadInput, ATakenPortIsANetworkError) {
    ThreadWall wall({.wall = "1x1"});
    ASSERT_FALSE(wall.address().empty());
    expect("taken port", {"--wall", "1x1", "--scene", kYard, "--listen", wall.address()}, 4, {wall.address()});
}

TEST_F(BadInput, AnImportThatFailsWhileTheWallRunsIsAnAnswerAndNothingElse) {
    ThreadWall wall({.wall = "1x1", .server = {"--allow", folder_.path()}});
    ASSERT_FALSE(wall.address().empty());
    wall.startClient("all");
    ASSERT_TRUE(wall.waitForFrame("front-0-0", 3, 30s)) << wall.logs();
    const Outcome loaded = wall.ctl({"load", folder_.write("bad.ply", "ply\nformat nonsense 1.0\nend_header\n")});
    EXPECT_EQ(loaded.exitCode, 3) << loaded.output;
    EXPECT_NE(loaded.output.find("bad.ply"), std::string::npos) << loaded.output;
    const std::int64_t now = wall.shownFrame("front-0-0");
    EXPECT_TRUE(wall.waitForFrame("front-0-0", now + 10, 10s));
}

}  // namespace
}  // namespace tessera::test
