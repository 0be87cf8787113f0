/// What servers leave for the programs of their user.
#include <gtest/gtest.h>

#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "common/access/LocalWalls.h"
#include "tests/unit/TestFolder.h"

namespace tessera {
namespace {

class LocalWalls : public testing::Test {
protected:
    LocalWalls() { setenv("XDG_RUNTIME_DIR", folder_.path().c_str(), 1); }
    ~LocalWalls() override { unsetenv("XDG_RUNTIME_DIR"); }
    [[nodiscard]] std::string run(const std::string& name = "") const {
        return folder_.path() + "/tessera" + (name.empty() ? "" : "/" + name);
    }
    static std::unique_ptr<LocalWallPlace> place(const std::string& wall) {
        Expected<std::unique_ptr<LocalWallPlace>> taken = LocalWallPlace::take(wall);
        EXPECT_TRUE(taken) << taken.error().message;
        return taken ? std::move(*taken) : nullptr;
    }

    test::TestFolder folder_;
};

TEST_F(LocalWalls, ATokenOutlivesItsServer) {
    std::string token;
    {
        const std::unique_ptr<LocalWallPlace> first = place("cave4");
        EXPECT_EQ(first->lastConsolePort(), 0);
        token = first->token();
        EXPECT_EQ(token.size(), 64u);
        ASSERT_TRUE(first->tell({"127.0.0.1", 7000}, Address{"127.0.0.1", 7001}));
        const Expected<LocalWall> found = onlyLocalWall();
        ASSERT_TRUE(found) << found.error().message;
        EXPECT_EQ(found->wall, "cave4");
        EXPECT_EQ(toString(found->server), "127.0.0.1:7000");
        EXPECT_EQ(toString(found->console.value()), "127.0.0.1:7001");
        EXPECT_EQ(found->token, token);
    }
    EXPECT_TRUE(localWalls()->empty()) << "it runs no more";
    EXPECT_EQ(onlyLocalWall().error().code, ErrorCode::kNotFound);
    const std::unique_ptr<LocalWallPlace> second = place("cave4");
    EXPECT_EQ(second->token(), token);
    EXPECT_EQ(second->lastConsolePort(), 7001);
    EXPECT_TRUE(localWalls()->empty()) << "where the one before listened is no longer so";
}

TEST_F(LocalWalls, SeveralAtOnceHaveAPlaceEach) {
    const std::unique_ptr<LocalWallPlace> a = place("2x2"), b = place("2x2"), c = place("../../etc/pass wd\n");
    EXPECT_NE(a->token(), b->token());
    ASSERT_TRUE(a->tell({"127.0.0.1", 1}, std::nullopt) && b->tell({"127.0.0.1", 2}, std::nullopt) &&
                c->tell({"::1", 3}, std::nullopt));
    const Expected<std::vector<LocalWall>> all = localWalls();
    ASSERT_TRUE(all);
    ASSERT_EQ(all->size(), 3u);
    const Expected<LocalWall> only = onlyLocalWall();
    ASSERT_FALSE(only);
    EXPECT_EQ(only.error().code, ErrorCode::kUsage);
    EXPECT_NE(only.error().message.find("127.0.0.1:2 (2x2)"), std::string::npos) << only.error().message;
}

TEST_F(LocalWalls, TheServerThatIsMeantIsSaidOrNamedOrTheOnlyOne) {
    const std::unique_ptr<LocalWallPlace> mine = place("wall");
    ASSERT_TRUE(mine->tell({"127.0.0.1", 7000}, std::nullopt));
    const auto meant = [](const std::string& said) {
        const Expected<Address> address = serverMeant(said);
        return address ? toString(*address) : address.error().message;
    };
    unsetenv("TESSERA_SERVER");
    EXPECT_EQ(meant(""), "127.0.0.1:7000");
    setenv("TESSERA_SERVER", "master:7001", 1);
    EXPECT_EQ(meant(""), "master:7001");
    EXPECT_EQ(meant("other:1"), "other:1");
    setenv("TESSERA_SERVER", "master", 1);
    EXPECT_TRUE(meant("").starts_with("TESSERA_SERVER: ")) << meant("");
    unsetenv("TESSERA_SERVER");
}

/// The lock is the process's, however that ends.
TEST_F(LocalWalls, OneThatIsKilledRunsNoMore) {
    int ready[2];
    ASSERT_EQ(pipe(ready), 0);
    const pid_t child = fork();
    if (child == 0) {
        const Expected<std::unique_ptr<LocalWallPlace>> taken = LocalWallPlace::take("wall");
        const bool told = taken && (*taken)->tell({"127.0.0.1", 7000}, std::nullopt);
        (void)!write(ready[1], told ? "1" : "0", 1);
        pause();
        _exit(0);
    }
    char told = 0;
    ASSERT_EQ(read(ready[0], &told, 1), 1);
    ASSERT_EQ(told, '1');
    EXPECT_EQ(localWalls()->size(), 1u);
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    EXPECT_TRUE(localWalls()->empty());
    close(ready[0]);
    close(ready[1]);
}

TEST_F(LocalWalls, AreForTheirUserAlone) {
    const std::unique_ptr<LocalWallPlace> mine = place("wall");
    ASSERT_TRUE(mine->tell({"127.0.0.1", 7000}, std::nullopt));
    struct stat info {};
    ASSERT_EQ(stat(run().c_str(), &info), 0);
    EXPECT_EQ(info.st_mode & 0777, 0700u);
    ASSERT_EQ(stat(run("wall-1.wall").c_str(), &info), 0);
    EXPECT_EQ(info.st_mode & 0777, 0600u);
    // A file that others may read, a link, a pipe: none of them counts, and nobody waits.
    chmod(run("wall-1.wall").c_str(), 0644);
    EXPECT_TRUE(localWalls()->empty());
    chmod(run("wall-1.wall").c_str(), 0600);
    std::filesystem::create_symlink(run("wall-1.wall"), run("link-1.wall"));
    ASSERT_EQ(mkfifo(run("pipe-1.wall").c_str(), 0600), 0);
    EXPECT_EQ(localWalls()->size(), 1u);
    EXPECT_FALSE(LocalWallPlace::take("link"));
    EXPECT_FALSE(LocalWallPlace::take("pipe"));
    // A folder that others may look into.
    chmod(run().c_str(), 0755);
    const Expected<std::vector<LocalWall>> open = localWalls();
    ASSERT_FALSE(open);
    EXPECT_EQ(open.error().code, ErrorCode::kRefused);
    EXPECT_NE(open.error().message.find("XDG_RUNTIME_DIR"), std::string::npos);
    chmod(run().c_str(), 0700);
}

TEST_F(LocalWalls, WhatIsTornOrRubbishIsNotThere) {
    const std::unique_ptr<LocalWallPlace> mine = place("wall");
    for (const std::string text : {"", "end\n", "wall w\nserver 127.0.0.1:7000\ntoken x\n",
                                   "wall w\nserver nowhere\ntoken x\nend\n", "\nend\n"}) {
        std::ofstream(run("wall-1.wall"), std::ios::trunc) << text;
        const Expected<std::vector<LocalWall>> all = localWalls();
        ASSERT_TRUE(all);
        EXPECT_TRUE(all->empty()) << text;
    }
    std::ofstream(run("wall-1.wall"), std::ios::trunc) << std::string(100'000, 'x');
    EXPECT_TRUE(localWalls()->empty());
    EXPECT_TRUE(mine->tell({"127.0.0.1", 7000}, std::nullopt));
    EXPECT_EQ(localWalls()->size(), 1u);
}

}  // namespace
}  // namespace tessera
