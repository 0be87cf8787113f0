/// How long a token serves that a person chose (--token-file), and where its end is kept.
#include <gtest/gtest.h>

#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/access/ChosenTokens.h"
#include "common/access/LocalWalls.h"
#include "common/access/ServerTokens.h"
#include "common/tls/Certificate.h"
#include "tests/support/words/Words.h"
#include "tests/unit/TestFolder.h"

namespace tessera {
namespace {

/// With folders of the test's own: the run folder, the state folder, and one for keys.
class ChosenTokensTest : public testing::Test {
protected:
    static inline const std::string kAuthority = std::string(64, 'a'), kOtherAuthority = std::string(64, 'b');
    static inline const std::string kChosen = "the-token-that-a-person-has-chosen";
    static inline const NamedServer kServer{"cave", "127.0.0.1:7000"}, kOther{"hall", "0.0.0.0:7000"};
    static inline const WallProtection kHere{}, kInsecure{.insecure = true}, kKeys{.authority = kAuthority};

    ChosenTokensTest() {
        setenv("XDG_RUNTIME_DIR", folder_.path().c_str(), 1);
        setenv("XDG_STATE_HOME", (folder_ / "state").c_str(), 1);
        std::filesystem::create_directory(keys());
        chmod(keys().c_str(), 0700);
    }
    ~ChosenTokensTest() override {
        unsetenv("XDG_RUNTIME_DIR");
        unsetenv("XDG_STATE_HOME");
    }
    [[nodiscard]] std::string keys() const { return folder_ / "keys"; }
    [[nodiscard]] std::string stateFile() const { return folder_ / "state/tessera/chosen-tokens"; }
    [[nodiscard]] std::string keysFile() const { return keys() + "/chosen-tokens"; }
    void restartMachine() const { std::filesystem::remove_all(folder_ / "tessera"); }

    /// Returns "serves", "ended", or why not.
    [[nodiscard]] std::string use(const WallProtection& protection, const std::string& token = kChosen,
                                  const NamedServer& server = kServer) const {
        const Expected<void> used =
            ChosenTokens(protection.authority.empty() ? "" : keys()).use(token, server, protection);
        if (used) return "serves";
        const bool hasEnded = used.error().code == ErrorCode::kUsage;
        return hasEnded ? "ended" : used.error().message;
    }
    void startOtherwise(const WallProtection& protection, const NamedServer& server = kServer) const {
        const Expected<void> ended =
            ChosenTokens(protection.authority.empty() ? "" : keys()).endOthers(server, protection);
        EXPECT_TRUE(ended) << ended.error().message;
    }
    /// A server with the token in a file.
    [[nodiscard]] Expected<ServerTokens> start(const std::string& token, const std::string& authority = {}) const {
        std::ofstream(folder_ / "word") << token << "\n";
        ServerTokensOptions options{.wall = kServer.wall,
                                    .listen = kServer.listen,
                                    .tokenFile = token.empty() ? "" : folder_ / "word",
                                    .keysFolder = authority.empty() ? "" : keys()};
        if (!authority.empty()) options.authority = [authority] { return authority; };
        return ServerTokens::make(std::move(options), [](const std::string&) {});
    }
    static std::string textOf(const std::string& path) {
        std::ostringstream text;
        text << std::ifstream(path).rdbuf();
        return text.str();
    }

    test::TestFolder folder_;
};

TEST_F(ChosenTokensTest, ServeUnderOneProtectionForAllWalls) {
    for (const WallProtection& first : {kHere, kInsecure, kKeys}) {
        const std::string token = kChosen + std::to_string(first.text().size());
        EXPECT_EQ(use(first, token), "serves");
        for (const WallProtection& then : {kHere, kInsecure, kKeys, WallProtection{.authority = kOtherAuthority},
                                           WallProtection{.authority = kAuthority, .mark = "revoked"}})
            for (const NamedServer& server : {kServer, kOther})
                EXPECT_EQ(use(then, token, server), then.text() == first.text() ? "serves" : "ended")
                    << first.text() << " then " << then.text();
    }
}

/// Whoever starts in between: it does not come back with its protection.
TEST_F(ChosenTokensTest, EndWithTheProtectionOfTheirServer) {
    EXPECT_EQ(use(kKeys), "serves");
    startOtherwise(kInsecure, kOther);
    EXPECT_EQ(use(kKeys), "serves") << "it is another server";
    startOtherwise(kInsecure);
    EXPECT_EQ(use(kKeys), "ended");
    EXPECT_EQ(use(kInsecure), "ended");
}

/// However many ended since: each of them stays so.
TEST_F(ChosenTokensTest, ThatEndedAreAllRemembered) {
    constexpr int kMany = 100;
    WallProtection protection;
    for (int i = 0; i < kMany; ++i) {
        EXPECT_EQ(use(protection, kChosen + std::to_string(i)), "serves");
        ASSERT_TRUE(endLocalLinks());
        protection.mark = readLinksMark(folder_ / "tessera")->value();
    }
    restartMachine();
    for (int i = 0; i < kMany; ++i) EXPECT_EQ(use(kHere, kChosen + std::to_string(i)), "ended") << i;
}

TEST_F(ChosenTokensTest, ThatNobodyEndedServeAfterTheMachineForgotItsMark) {
    ASSERT_TRUE(endLocalLinks());
    const WallProtection marked{.mark = readLinksMark(folder_ / "tessera")->value()};
    EXPECT_EQ(use(marked), "serves");
    restartMachine();
    EXPECT_EQ(use(kHere), "serves");
    EXPECT_EQ(use(kInsecure), "ended");
    ASSERT_TRUE(endLocalLinks());
    restartMachine();
    EXPECT_EQ(use(kHere), "ended");
}

TEST_F(ChosenTokensTest, AreRememberedByEitherFolder) {
    const auto revoke = [&] {
        const KeyFolder folder(keys());
        const Expected<KeyFolder::Writer> writer = KeyFolder::Writer::open(folder);
        ASSERT_TRUE(writer && ChosenTokens::endIn(folder, *writer));
    };
    EXPECT_EQ(use(kKeys), "serves");
    revoke();
    std::filesystem::remove_all(folder_ / "state");
    EXPECT_EQ(use(kKeys), "ended") << "the keys' folder has it";
    EXPECT_FALSE(std::filesystem::exists(stateFile())) << "a token that is refused is written nowhere";
    EXPECT_EQ(use(kInsecure, kChosen + "2"), "serves");
    EXPECT_EQ(use(kKeys, kChosen + "2"), "ended") << "the state folder has it";
    EXPECT_EQ(textOf(keysFile()).find(hashOfToken(kChosen + "2")), std::string::npos);
}

TEST_F(ChosenTokensTest, EndWhileTheirServerRunsAndStaySo) {
    Expected<ServerTokens> server = start(kChosen, kAuthority);
    ASSERT_TRUE(server) << server.error().message;
    EXPECT_EQ(server->tokens().of(Role::kOperator), kChosen);
    ASSERT_TRUE(renewLinksMark(keys()));
    EXPECT_EQ(server->look().value_or(false), true);
    EXPECT_NE(server->tokens().of(Role::kOperator), kChosen);
    EXPECT_EQ(server->look().value_or(true), false);
    EXPECT_NE(textOf(stateFile()).find(hashOfToken(kChosen) + " ended\n"), std::string::npos);
    restartMachine();
    std::filesystem::remove(keys() + "/links");
    const Expected<ServerTokens> again = start(kChosen, kAuthority);
    ASSERT_FALSE(again);
    EXPECT_EQ(again.error().code, ErrorCode::kUsage);
    EXPECT_WORDS(again.error().message);
}

TEST_F(ChosenTokensTest, AreKeptAsHashesForThisUserAlone) {
    EXPECT_EQ(use(kKeys), "serves");
    for (const std::string& path : {stateFile(), keysFile()}) {
        EXPECT_NE(textOf(path).find(hashOfToken(kChosen)), std::string::npos) << path;
        EXPECT_EQ(textOf(path).find(kChosen), std::string::npos) << path;
        struct stat info {};
        ASSERT_EQ(stat(path.c_str(), &info), 0);
        EXPECT_EQ(info.st_mode & 0777, 0600u) << path;
    }
    struct stat info {};
    ASSERT_EQ(stat((folder_ / "state/tessera").c_str(), &info), 0);
    EXPECT_EQ(info.st_mode & 0777, 0700u);
}

/// None is forgotten: a server refuses more, in words.
TEST_F(ChosenTokensTest, OfMoreThanCanBeKeptNoneServes) {
    EXPECT_EQ(use(kHere), "serves");
    std::string text = textOf(stateFile());
    text.resize(text.size() - std::string("end\n").size());
    for (std::size_t i = 1; i < ChosenTokens::kMostLines; ++i) text += hashOfToken(std::to_string(i)) + " ended\n";
    std::ofstream(stateFile(), std::ios::trunc) << text << "end\n";
    EXPECT_EQ(use(kHere), "serves") << "it is among them";
    EXPECT_WORDS(use(kHere, kChosen + "2"));
    startOtherwise(kInsecure);
    EXPECT_EQ(use(kHere), "ended") << "an end takes no room";
    EXPECT_LT(std::filesystem::file_size(stateFile()), 1u << 20);
}

TEST_F(ChosenTokensTest, WhoseEndCannotBeKeptDoNotServe) {
    std::ofstream(folder_ / "state") << "a file where the folder should be";
    const std::string why = use(kHere);
    EXPECT_NE(why.find("state/tessera"), std::string::npos) << why;
    EXPECT_WORDS(why);
    EXPECT_FALSE(start(kChosen));
    EXPECT_TRUE(start("")) << "without such a token a server needs no such folder";
    std::filesystem::remove(folder_ / "state");
    std::filesystem::create_directories(folder_ / "state/tessera");
    chmod((folder_ / "state/tessera").c_str(), 0777);
    EXPECT_WORDS(use(kHere));
    chmod((folder_ / "state/tessera").c_str(), 0700);
    EXPECT_EQ(use(kHere), "serves");
    const char* const home = std::getenv("HOME");
    const std::string before = home ? home : "";
    unsetenv("XDG_STATE_HOME");
    unsetenv("HOME");
    EXPECT_WORDS(use(kHere));
    setenv("HOME", folder_.path().c_str(), 1);
    EXPECT_EQ(stateFolder(), folder_ / ".local/state/tessera");
    EXPECT_EQ(use(kHere), "serves");
    if (home)
        setenv("HOME", before.c_str(), 1);
    else
        unsetenv("HOME");
}

TEST_F(ChosenTokensTest, OfADamagedFileDoNotServe) {
    EXPECT_EQ(use(kHere), "serves");
    const std::string good = textOf(stateFile()), hash = hashOfToken(kChosen);
    for (const std::string& text :
         {std::string(), std::string("end"), good.substr(0, good.size() - 4), "rubbish\n" + good, hash + "\nend\n",
          hash + " ended more\nend\n", hash.substr(1) + " ended\nend\n", good + good, "\n" + good}) {
        std::ofstream(stateFile(), std::ios::trunc) << text;
        EXPECT_WORDS(use(kHere));
        EXPECT_FALSE(endLocalLinks()) << text;
    }
    EXPECT_TRUE(start("")) << "it is told, and nobody's token is in danger";
    std::ofstream(stateFile(), std::ios::trunc) << good;
    EXPECT_EQ(use(kHere), "serves");
    chmod(stateFile().c_str(), 0644);
    EXPECT_WORDS(use(kHere));
}

/// Many servers of a user start at once.
TEST_F(ChosenTokensTest, NoOneOfServersThatStartTogetherIsLost) {
    constexpr int kServers = 16;
    std::vector<pid_t> children;
    for (int i = 0; i < kServers; ++i) {
        const pid_t child = fork();
        ASSERT_GE(child, 0);
        if (child == 0) _exit(use(kHere, kChosen + std::to_string(i)) == "serves" ? 0 : 1);
        children.push_back(child);
    }
    for (const pid_t child : children) {
        int status = 0;
        waitpid(child, &status, 0);
        EXPECT_EQ(status, 0);
    }
    for (int i = 0; i < kServers; ++i) EXPECT_EQ(use(kInsecure, kChosen + std::to_string(i)), "ended");
}

}  // namespace
}  // namespace tessera
