/// What servers leave for the programs of their user.
#include <gtest/gtest.h>

#include <grp.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>

#include "common/access/LocalWalls.h"
#include "tests/support/words/Words.h"
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
        Expected<std::unique_ptr<LocalWallPlace>> taken = LocalWallPlace::take({.wall = wall, .listen = "127.0.0.1:0"});
        EXPECT_TRUE(taken) << taken.error().message;
        return taken ? std::move(*taken) : nullptr;
    }

    test::TestFolder folder_;
};

TEST_F(LocalWalls, ATokenOutlivesItsServer) {
    AccessTokens tokens;
    {
        const std::unique_ptr<LocalWallPlace> first = place("cave4");
        EXPECT_EQ(first->lastConsolePort(), 0);
        tokens = first->tokens();
        for (const std::string& token : tokens.words) EXPECT_EQ(token.size(), 43u);
        ASSERT_TRUE(first->tell({"127.0.0.1", 7000}, Address{"127.0.0.1", 7001}));
        const Expected<LocalWall> found = onlyLocalWall();
        ASSERT_TRUE(found) << found.error().message;
        EXPECT_EQ(found->wall, "cave4");
        EXPECT_EQ(toString(found->server), "127.0.0.1:7000");
        EXPECT_EQ(toString(found->console.value()), "127.0.0.1:7001");
        EXPECT_EQ(found->tokens.words, tokens.words);
    }
    EXPECT_TRUE(localWalls()->empty()) << "it runs no more";
    EXPECT_EQ(onlyLocalWall().error().code, ErrorCode::kNotFound);
    const std::unique_ptr<LocalWallPlace> second = place("cave4");
    EXPECT_EQ(second->tokens().words, tokens.words);
    EXPECT_EQ(second->lastConsolePort(), 7001);
    EXPECT_TRUE(localWalls()->empty()) << "where the one before listened is no longer so";
}

/// Their files may be called alike, and so may the lines in them.
TEST_F(LocalWalls, OneTakesNothingOfAnotherWhoseNameIsWrittenAlike) {
    const std::string longName(300, 'x');
    const std::vector<std::pair<std::string, std::string>> pairs{
        {"\u5317", "\u5357"}, {"hall a", "hall.a"}, {longName, longName + "y"}, {"a\tb", "a\nb"}};
    for (const auto& [one, other] : pairs) {
        AccessTokens tokens;
        {
            const std::unique_ptr<LocalWallPlace> first = place(one);
            tokens = first->tokens();
            ASSERT_TRUE(first->tell({"127.0.0.1", 7000}, Address{"127.0.0.1", 7001}));
        }
        {
            const std::unique_ptr<LocalWallPlace> second = place(other);
            for (const std::string& token : second->tokens().words)
                EXPECT_EQ(std::ranges::count(tokens.words, token), 0) << one << " and " << other;
            EXPECT_EQ(second->lastConsolePort(), 0);
        }
        EXPECT_EQ(place(one)->tokens().words, tokens.words) << one;
    }
}

/// As an earlier version has left it, without a mark.
TEST_F(LocalWalls, APlaceWithoutAMarkIsTheWallsThatItNames) {
    AccessTokens tokens;
    {
        const std::unique_ptr<LocalWallPlace> first = place("cave4");
        tokens = first->tokens();
        ASSERT_TRUE(first->tell({"127.0.0.1", 7000}, std::nullopt));
    }
    std::string text;
    for (std::ifstream in(run("cave4-1.wall")); std::getline(in, text, '\0');) break;
    const std::size_t mark = text.find("mark ");
    ASSERT_NE(mark, std::string::npos) << text;
    text.erase(mark, text.find('\n', mark) + 1 - mark);
    std::ofstream(run("cave4-1.wall")) << text;
    EXPECT_EQ(place("cave4")->tokens().words, tokens.words);
}

TEST_F(LocalWalls, SeveralAtOnceHaveAPlaceEach) {
    const std::unique_ptr<LocalWallPlace> a = place("2x2"), b = place("2x2"), c = place("../../etc/pass wd\n");
    EXPECT_NE(a->tokens().words, b->tokens().words);
    ASSERT_TRUE(a->tell({"127.0.0.1", 1}, std::nullopt) && b->tell({"127.0.0.1", 2}, std::nullopt) &&
                c->tell({"::1", 3}, std::nullopt));
    const Expected<std::vector<LocalWall>> all = localWalls();
    ASSERT_TRUE(all);
    ASSERT_EQ(all->size(), 3u);
    const Expected<LocalWall> only = onlyLocalWall();
    ASSERT_FALSE(only);
    EXPECT_EQ(only.error().code, ErrorCode::kUsage);
    EXPECT_WORDS(only.error().message);
}

TEST_F(LocalWalls, TheServerThatIsMeantIsSaidOrNamedOrTheOnlyOne) {
    const std::unique_ptr<LocalWallPlace> mine = place("wall");
    ASSERT_TRUE(mine->tell({"127.0.0.1", 7000}, std::nullopt));
    const auto meant = [](const std::string& said) {
        const Expected<ServerMeant> server = serverMeant(said);
        return server ? toString(server->address) + (server->namedBy.empty() ? "" : " by " + server->namedBy)
                      : server.error().message;
    };
    setenv("XDG_CONFIG_HOME", folder_.path().c_str(), 1);
    unsetenv("TESSERA_SERVER");
    EXPECT_EQ(meant(""), "127.0.0.1:7000");
    setenv("TESSERA_SERVER", "master:7001", 1);
    EXPECT_EQ(meant(""), "master:7001 by TESSERA_SERVER");
    EXPECT_EQ(meant("other:1"), "other:1");
    setenv("TESSERA_SERVER", "master", 1);
    EXPECT_TRUE(meant("").starts_with("TESSERA_SERVER: ")) << meant("");
    unsetenv("TESSERA_SERVER");
    unsetenv("XDG_CONFIG_HOME");
}

/// Before the only wall here, behind the variable; one that is there and wrong is not passed over.
TEST_F(LocalWalls, TheServerMayStandInAFileOfTheUser) {
    const std::unique_ptr<LocalWallPlace> mine = place("wall");
    ASSERT_TRUE(mine->tell({"127.0.0.1", 7000}, std::nullopt));
    setenv("XDG_CONFIG_HOME", folder_.path().c_str(), 1);
    unsetenv("TESSERA_SERVER");
    const std::string file = serverFile();
    EXPECT_EQ(file, folder_.path() + "/tessera/server");
    std::filesystem::create_directories(folder_.path() + "/tessera");
    const auto withText = [&](const std::string& text) {
        std::ofstream(file) << text;
        const Expected<ServerMeant> server = serverMeant("");
        if (server) {
            EXPECT_EQ(server->namedBy, file);
        }
        return server ? toString(server->address) : server.error().message;
    };
    EXPECT_EQ(withText("master:7001\n"), "master:7001");
    EXPECT_EQ(withText("# the wall downstairs\n\n  [fe80::1]:7002 \r\n"), "[fe80::1]:7002");
    EXPECT_EQ(toString(serverMeant("other:1")->address), "other:1");
    setenv("TESSERA_SERVER", "variable:1", 1);
    EXPECT_EQ(toString(serverMeant("")->address), "variable:1");
    unsetenv("TESSERA_SERVER");
    for (const char* text : {"master\n", "", "# none\n", "a:1\nb:2\n"}) {
        const std::string said = withText(text);
        EXPECT_TRUE(said.starts_with(file + ": ")) << said;
        EXPECT_WORDS(said);
    }
    EXPECT_WORDS(withText(std::string(5000, '#')));
    std::filesystem::remove(file);
    std::filesystem::create_directory(file);
    EXPECT_TRUE(serverMeant("").error().message.starts_with(file + ": "));
    std::filesystem::remove(file);
    EXPECT_EQ(toString(serverMeant("")->address), "127.0.0.1:7000");
    unsetenv("XDG_CONFIG_HOME");
}

/// The lock is the process's, however that ends.
TEST_F(LocalWalls, OneThatIsKilledRunsNoMore) {
    int ready[2];
    ASSERT_EQ(pipe(ready), 0);
    const pid_t child = fork();
    if (child == 0) {
        const Expected<std::unique_ptr<LocalWallPlace>> taken =
            LocalWallPlace::take({.wall = "wall", .listen = "127.0.0.1:0"});
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
    EXPECT_FALSE(LocalWallPlace::take({.wall = "link", .listen = ""}));
    EXPECT_FALSE(LocalWallPlace::take({.wall = "pipe", .listen = ""}));
    // A folder that others may look into.
    chmod(run().c_str(), 0755);
    const Expected<std::vector<LocalWall>> open = localWalls();
    ASSERT_FALSE(open);
    EXPECT_EQ(open.error().code, ErrorCode::kRefused);
    EXPECT_WORDS(open.error().message);
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

TEST_F(LocalWalls, TellTheAuthorityOfAConsoleWithKeys) {
    const std::unique_ptr<LocalWallPlace> mine = place("a");
    mine->setAuthority(std::string(64, 'a'));
    ASSERT_TRUE(mine->tell({"127.0.0.1", 7000}, Address{"127.0.0.1", 7001}));
    EXPECT_EQ(localWalls()->at(0).authority, std::string(64, 'a'));
}

// ---- the word that lets a program in

class Access : public LocalWalls {
protected:
    ~Access() override {
        unsetenv("TESSERA_TOKEN_FILE");
        unsetenv("TESSERA_TOKEN");
    }
    [[nodiscard]] std::string file(const std::string& text) const {
        std::ofstream(folder_.path() + "/word") << text;
        return folder_.path() + "/word";
    }
    static std::string to(const std::string& address, const std::string& tokenFile = {}) {
        const Expected<std::string> word = accessTo(parseAddress(address).value(), tokenFile);
        return word ? *word : "error: " + word.error().message;
    }
};

TEST_F(Access, IsThatOfTheServerOfThisUserThere) {
    const std::unique_ptr<LocalWallPlace> a = place("a"), b = place("b");
    ASSERT_TRUE(a->tell({"127.0.0.1", 7000}, std::nullopt) && b->tell({"0.0.0.0", 7001}, std::nullopt));
    EXPECT_EQ(to("127.0.0.1:7000"), a->tokens().of(Role::kOperator));
    EXPECT_EQ(to("[::ffff:127.0.0.1]:7000"), a->tokens().of(Role::kOperator)) << "the same in IPv6's writing";
    EXPECT_EQ(to("127.0.0.1:7002"), "") << "nobody of this user listens there";
    // At another address of this machine somebody else may listen at the same port.
    for (const std::string other : {"127.0.0.9", "[::1]", "203.0.113.9", "localhost"})
        EXPECT_EQ(to(other + ":7000"), "") << other;
    // One that listens at all of them has them all, and those of other machines are not its own.
    for (const std::string own : {"127.0.0.1", "127.0.0.9", "[::1]"})
        EXPECT_EQ(to(own + ":7001"), b->tokens().of(Role::kOperator)) << own;
    EXPECT_EQ(to("203.0.113.9:7001"), "");
}

TEST_F(Access, APlaceIsTakenOverByWhoListensAlike) {
    const auto take = [](const std::string& listen) {
        return LocalWallPlace::take({.wall = "w", .listen = listen}).value();
    };
    const std::string first = take("127.0.0.1:7461")->tokens().of(Role::kOperator);
    const std::string second = take("127.0.0.1:7462")->tokens().of(Role::kOperator);
    EXPECT_NE(first, second) << "the place of the first is left alone";
    EXPECT_EQ(take("127.0.0.1:7462")->tokens().of(Role::kOperator), second) << "whichever starts again first";
    EXPECT_EQ(take("127.0.0.1:7461")->tokens().of(Role::kOperator), first);
    // However many have been there, with whatever ports: the next one finds a place, and words of its own.
    std::set<std::string> words;
    for (int port = 10'000; port < 10'110; ++port) {
        const auto taken = LocalWallPlace::take({.wall = "w", .listen = "127.0.0.1:" + std::to_string(port)});
        ASSERT_TRUE(taken) << taken.error().message;
        words.insert((*taken)->tokens().of(Role::kOperator));
    }
    EXPECT_EQ(words.size(), 110u);
}

TEST_F(Access, IsWhatAFileSaysThatIsNamed) {
    const std::unique_ptr<LocalWallPlace> a = place("a");
    ASSERT_TRUE(a->tell({"127.0.0.1", 7000}, std::nullopt));
    const std::string word(20, 'w');
    EXPECT_EQ(to("127.0.0.1:7000", file(word)), word);
    EXPECT_EQ(to("203.0.113.9:7000", file(word + "\r\nmore\n")), word);
    EXPECT_EQ(to("203.0.113.9:7000", a->path()), a->tokens().of(Role::kOperator))
        << "what a server has left is one, too";
    setenv("TESSERA_TOKEN_FILE", file(word).c_str(), 1);
    EXPECT_EQ(to("127.0.0.1:7000"), word);
    setenv("TESSERA_TOKEN", std::string(20, 'v').c_str(), 1);
    EXPECT_EQ(to("127.0.0.1:7000"), std::string(20, 'v'));
    EXPECT_EQ(to("127.0.0.1:7000", file(word)), word);
    setenv("TESSERA_TOKEN", "short", 1);
    EXPECT_WORDS(to("127.0.0.1:7000"));
    unsetenv("TESSERA_TOKEN");
    for (const std::string& wrong : {std::string(), std::string("short"), word + " two", std::string(10'000, 'w')})
        EXPECT_WORDS(to("127.0.0.1:7000", file(wrong)));
    EXPECT_WORDS(to("127.0.0.1:7000", "/no/such/file"));
    EXPECT_WORDS(to("127.0.0.1:7000", folder_.path()));
    const std::string pipe = folder_.path() + "/pipe";
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    EXPECT_WORDS(to("127.0.0.1:7000", pipe));
}

/// Others could read it on the way.
TEST_F(Access, LeavesThisMachineOverSealedLinksAlone) {
    const std::string word(20, 'w');
    const auto plain = accessLater(file(word), false), sealed = accessLater(file(word), true);
    ASSERT_TRUE(plain && sealed);
    EXPECT_EQ((*plain)("127.0.0.1:7000"), word);
    EXPECT_EQ((*plain)("203.0.113.9:7000"), "");
    EXPECT_EQ((*plain)("nonsense"), "");
    EXPECT_EQ((*sealed)("203.0.113.9:7000"), word);
}

TEST_F(Access, MayBeAGroups) {
    chmod(folder_.path().c_str(), 0711);
    const Expected<std::unique_ptr<LocalWallPlace>> none =
        LocalWallPlace::take({.wall = "w", .listen = "", .group = "no such group"});
    ASSERT_FALSE(none);
    EXPECT_EQ(none.error().code, ErrorCode::kNotFound);
    std::array<char, 4096> room{};
    struct group found {};
    struct group* known = nullptr;
    ASSERT_EQ(getgrgid_r(getegid(), &found, room.data(), room.size(), &known), 0);
    ASSERT_NE(known, nullptr);
    struct stat info {};
    {
        const Expected<std::unique_ptr<LocalWallPlace>> taken =
            LocalWallPlace::take({.wall = "w", .listen = "127.0.0.1:0", .group = known->gr_name});
        ASSERT_TRUE(taken) << taken.error().message;
        ASSERT_TRUE((*taken)->tell({"127.0.0.1", 7000}, std::nullopt));
        ASSERT_EQ(stat((*taken)->path().c_str(), &info), 0);
        EXPECT_EQ(info.st_mode & 0777, 0640u);
        ASSERT_EQ(stat(run().c_str(), &info), 0);
        EXPECT_EQ(info.st_mode & 0777, 0711u);
        EXPECT_EQ(localWalls()->size(), 1u) << "its own user reads it as before";
    }
    chmod(folder_.path().c_str(), 0700);
    const Expected<std::unique_ptr<LocalWallPlace>> barred =
        LocalWallPlace::take({.wall = "v", .listen = "", .group = known->gr_name});
    ASSERT_FALSE(barred) << "nobody of the group would reach it";
    EXPECT_NE(barred.error().message.find(folder_.path() + " lets nobody through"), std::string::npos)
        << barred.error().message;
    const std::unique_ptr<LocalWallPlace> again = place("w");
    ASSERT_EQ(stat(again->path().c_str(), &info), 0);
    EXPECT_EQ(info.st_mode & 0777, 0600u) << "without --group it is one user's again";
}

}  // namespace
}  // namespace tessera
