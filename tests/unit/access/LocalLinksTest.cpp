/// How long the tokens of a server serve, and the links that carry them.
#include <gtest/gtest.h>

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/access/LocalWalls.h"
#include "common/access/ServerTokens.h"
#include "common/access/WallProtection.h"
#include "tests/support/words/Words.h"
#include "tests/unit/TestFolder.h"

namespace tessera {
namespace {

const std::string kAuthority(64, 'a'), kOtherAuthority(64, 'b');
const std::string kChosen = "the-token-that-a-person-has-chosen";

class LocalLinks : public testing::Test {
protected:
    LocalLinks() {
        setenv("XDG_RUNTIME_DIR", folder_.path().c_str(), 1);
        setenv("XDG_STATE_HOME", (folder_ / "state").c_str(), 1);
    }
    ~LocalLinks() override {
        unsetenv("XDG_RUNTIME_DIR");
        unsetenv("XDG_STATE_HOME");
    }
    [[nodiscard]] std::string run() const { return folder_.path() + "/tessera"; }

    static std::unique_ptr<LocalWallPlace> start(const WallProtection& protection, const std::string& given = {},
                                                 const std::string& listen = "127.0.0.1:7000") {
        Expected<std::unique_ptr<LocalWallPlace>> taken =
            LocalWallPlace::take({.wall = "cave", .listen = listen, .protection = protection.text(), .given = given});
        EXPECT_TRUE(taken) << taken.error().message;
        return taken ? std::move(*taken) : nullptr;
    }
    static std::array<std::string, 3> tokensOf(const WallProtection& protection, const std::string& given = {}) {
        return start(protection, given)->tokens().words;
    }
    /// How many tokens both have.
    static std::size_t shared(const std::array<std::string, 3>& a, const std::array<std::string, 3>& b) {
        return static_cast<std::size_t>(
            std::ranges::count_if(a, [&](const std::string& one) { return std::ranges::find(b, one) != b.end(); }));
    }

    test::TestFolder folder_;
};

TEST_F(LocalLinks, HoldAfterARestartUnderTheSameProtection) {
    for (const WallProtection& same : {WallProtection{}, {.insecure = true}, {.authority = kAuthority}}) {
        const auto first = tokensOf(same);
        EXPECT_EQ(tokensOf(same), first) << same.text();
    }
}

TEST_F(LocalLinks, EndWhereTheProtectionIsAnotherOne) {
    const WallProtection all[] = {{},
                                  {.insecure = true},
                                  {.authority = kAuthority},
                                  {.authority = kOtherAuthority},
                                  {.authority = kAuthority, .insecure = true},
                                  {.authority = kAuthority, .mark = "revoked"},
                                  {.mark = "revoked"}};
    for (const WallProtection& before : all)
        for (const WallProtection& after : all) {
            if (before.text() == after.text()) continue;
            const auto first = tokensOf(before), second = tokensOf(after);
            EXPECT_EQ(shared(first, second), 0u) << before.text() << " then " << after.text();
            EXPECT_EQ(shared(first, tokensOf(before)), 0u) << "they do not come back: " << before.text();
        }
}

/// The file of a version that did not tell the protection: it may have been another one.
TEST_F(LocalLinks, OfAnUnknownProtectionEnd) {
    const auto first = tokensOf({});
    const std::string path = run() + "/cave-1.wall";
    std::ifstream file(path);
    std::string kept;
    for (std::string line; std::getline(file, line);)
        if (!line.starts_with("protection ")) kept += line + "\n";
    std::ofstream(path, std::ios::trunc) << kept;
    EXPECT_EQ(shared(first, tokensOf({})), 0u);
}

TEST_F(LocalLinks, AreRenewedWhileTheServerRunsAndStayEnded) {
    const std::unique_ptr<LocalWallPlace> place = start({.authority = kAuthority});
    ASSERT_TRUE(place->tell({"127.0.0.1", 7000}, Address{"127.0.0.1", 7001}));
    const auto before = place->tokens().words;
    const WallProtection revoked{.authority = kAuthority, .mark = "revoked"};
    ASSERT_TRUE(place->renewFor(revoked.text()));
    EXPECT_EQ(shared(before, place->tokens().words), 0u);
    const Expected<LocalWall> told = onlyLocalWall();
    ASSERT_TRUE(told) << told.error().message;
    EXPECT_EQ(told->tokens.words, place->tokens().words) << "this user's programs find the new ones";
    EXPECT_EQ(toString(told->console.value()), "127.0.0.1:7001");
}

TEST_F(LocalLinks, OfAChosenTokenServeAsLongAsItIsNamed) {
    const auto first = tokensOf({}, kChosen);
    EXPECT_EQ(first[2], kChosen);
    EXPECT_EQ(tokensOf({}, kChosen), first);
    EXPECT_NE(tokensOf({})[2], kChosen) << "nobody names it any more";
}

/// The tokens of a server that is not running are gone, whatever becomes of the mark until it starts again.
TEST_F(LocalLinks, OfAStoppedWallStayEndedThoughTheMarkIsLost) {
    const auto at = [](const WallProtection& protection, const char* listen) {
        return start(protection, "", listen)->tokens().words;
    };
    const WallProtection keys{.authority = kAuthority}, others{.authority = kOtherAuthority};
    const auto first = tokensOf({}), ofKeys = at(keys, "127.0.0.1:7001"), ofOthers = at(others, "127.0.0.1:7002");
    const auto running = start({}, "", "127.0.0.1:8000");
    const auto before = running->tokens().words;
    ASSERT_TRUE(endLocalLinks());
    EXPECT_EQ(running->tokens().words, before) << "it sees the mark";
    std::filesystem::remove(run() + "/links");
    EXPECT_EQ(shared(first, tokensOf({})), 0u);
    EXPECT_EQ(at(keys, "127.0.0.1:7001"), ofKeys);
    ASSERT_TRUE(forgetStoppedWalls(kAuthority));
    EXPECT_EQ(shared(ofKeys, at(keys, "127.0.0.1:7001")), 0u);
    EXPECT_EQ(at(others, "127.0.0.1:7002"), ofOthers);
}

/// Servers of tasks without a session are this user's as well, and all tasks look for them at one place.
TEST_F(LocalLinks, AreFoundWhereATaskWithoutASessionLeavesThemWhateverItsVariablesSay) {
    const char* const given = std::getenv("TMPDIR");
    const std::string before = given != nullptr ? given : "";
    const std::string ofTask = "tessera-" + std::to_string(geteuid());
    std::filesystem::create_directory(folder_ / ofTask);
    std::filesystem::permissions(folder_ / ofTask, std::filesystem::perms::owner_all);
    const std::string stopped = start({.authority = kAuthority})->path(), left = folder_ / (ofTask + "/cave-1.wall");
    std::filesystem::copy_file(stopped, left);
    std::filesystem::permissions(left, std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
    unsetenv("XDG_RUNTIME_DIR");
    unsetenv("TMPDIR");
    const Expected<std::vector<std::string>> plain = runFolders();
    setenv("TMPDIR", folder_.path().c_str(), 1);
    const Expected<std::vector<std::string>> elsewhere = runFolders();
    EXPECT_TRUE(forgetStoppedWalls(kAuthority));
    EXPECT_EQ(std::filesystem::file_size(left), 0u);
    setenv("XDG_RUNTIME_DIR", folder_.path().c_str(), 1);
    const Expected<std::vector<std::string>> said = runFolders();
    before.empty() ? unsetenv("TMPDIR") : setenv("TMPDIR", before.c_str(), 1);
    ASSERT_TRUE(plain && elsewhere && said);
    // Earlier versions put them where TMPDIR said: their servers may still run, or have left tokens.
    std::vector<std::string> all = *plain;
    all.push_back(folder_ / ofTask);
    EXPECT_EQ(*elsewhere, all);
    const std::string own = "/tmp/" + ofTask;
    EXPECT_EQ(std::ranges::count(*plain, own), std::filesystem::exists(own) ? 1 : 0);
    EXPECT_EQ(*said, std::vector<std::string>{run()}) << "who names a folder means that one";
}

TEST_F(LocalLinks, OfWallsWithoutKeysAreEndedTogether) {
    const std::unique_ptr<LocalWallPlace> place = start({});
    ASSERT_TRUE(place->tell({"127.0.0.1", 7000}, std::nullopt));
    const std::unique_ptr<LocalWallPlace> other = start({.authority = kAuthority}, "", "127.0.0.1:8000");
    other->setAuthority(kAuthority);
    ASSERT_TRUE(other->tell({"127.0.0.1", 8000}, std::nullopt));
    ASSERT_TRUE(readLinksMark(run()));
    EXPECT_EQ(*readLinksMark(run()), std::nullopt);
    for (std::optional<std::string> before; const int time : {1, 2}) {
        const Expected<std::vector<LocalWall>> running = endLocalLinks();
        ASSERT_TRUE(running) << running.error().message;
        ASSERT_EQ(running->size(), 1u) << "a wall with keys has its links ended among its keys";
        EXPECT_EQ(toString(running->front().server), "127.0.0.1:7000");
        const Expected<std::optional<std::string>> mark = readLinksMark(run());
        ASSERT_TRUE(mark && *mark) << time;
        EXPECT_NE(*mark, before);
        before = *mark;
    }
    struct stat info {};
    ASSERT_EQ(stat((run() + "/links").c_str(), &info), 0);
    EXPECT_EQ(info.st_mode & 0777, 0600u);
    const auto entries = std::filesystem::directory_iterator(run());
    EXPECT_EQ(std::distance(begin(entries), end(entries)), 3) << "nothing unfinished stays";
}

/// By it the server's console comes in for others.
TEST_F(LocalLinks, TheConsolesOwnTokenIsAnotherInEachRun) {
    const auto make = [] {
        Expected<ServerTokens> made =
            ServerTokens::make({.wall = "cave", .listen = "127.0.0.1:7000"}, [](const std::string&) {});
        EXPECT_TRUE(made) << made.error().message;
        return made ? made->tokens() : AccessTokens();
    };
    const AccessTokens first = make(), second = make();
    EXPECT_EQ(first.words, second.words);
    EXPECT_NE(first.door, second.door);
    EXPECT_EQ(shared(first.words, {first.door, second.door, ""}), 0u);
}

TEST_F(LocalLinks, TokensOfARunningServerFollowTheMarkAndTheAuthority) {
    std::filesystem::create_directories(folder_ / "keys");
    std::string authority = kAuthority;
    Expected<ServerTokens> made = ServerTokens::make({.wall = "cave",
                                                      .listen = "127.0.0.1:7000",
                                                      .keysFolder = folder_ / "keys",
                                                      .authority = [&] { return authority; }},
                                                     [](const std::string&) {});
    ASSERT_TRUE(made) << made.error().message;
    ASSERT_TRUE(made->tell({"127.0.0.1", 7000}, std::nullopt));
    auto before = made->tokens();
    const auto looks = [&] {
        const Expected<bool> looked = made->look();
        const bool ended = shared(before.words, made->tokens().words) == 0;
        EXPECT_TRUE(ended || before.words == made->tokens().words);
        EXPECT_EQ(before.door, made->tokens().door) << "the console's connections go on";
        before = made->tokens();
        return looked ? std::string(*looked && ended ? "ended" : "holds") : looked.error().message;
    };
    EXPECT_EQ(looks(), "holds");
    ASSERT_TRUE(renewLinksMark(run()));
    EXPECT_EQ(looks(), "holds") << "the mark of walls without keys";
    ASSERT_TRUE(renewLinksMark(folder_ / "keys"));
    EXPECT_EQ(looks(), "ended");
    EXPECT_EQ(looks(), "holds");
    EXPECT_EQ(onlyLocalWall()->tokens.words, made->tokens().words);
    // A folder that is away for a while, or cannot be read, has revoked nothing.
    std::filesystem::rename(folder_ / "keys", folder_ / "away");
    EXPECT_EQ(looks(), "holds");
    std::filesystem::rename(folder_ / "away", folder_ / "keys");
    EXPECT_EQ(looks(), "holds");
    std::ofstream(folder_ / "keys/links", std::ios::trunc) << "rubbish";
    EXPECT_WORDS(looks());
    ASSERT_TRUE(renewLinksMark(folder_ / "keys"));
    EXPECT_EQ(looks(), "ended");
    authority = kOtherAuthority;
    EXPECT_EQ(looks(), "ended");
    EXPECT_EQ(onlyLocalWall()->authority, kOtherAuthority);
}

TEST_F(LocalLinks, AMarkThatIsNoneIsNamed) {
    std::filesystem::create_directories(run());
    const std::string path = run() + "/links";
    const auto fault = [&] {
        const Expected<std::optional<std::string>> mark = readLinksMark(run());
        return mark ? std::string("none") : mark.error().message;
    };
    for (const std::string text : {"", "\n", "short\n", "the-mark-is-not-whole", "the mark is of several words\n"}) {
        std::ofstream(path, std::ios::trunc) << text;
        EXPECT_EQ(fault().find(path + ": holds no mark"), 0u) << text << fault();
    }
    std::ofstream(path, std::ios::trunc) << std::string(10'000, 'x') << "\n";
    EXPECT_EQ(fault().find(path + ": holds no mark"), 0u);
    ASSERT_TRUE(renewLinksMark(run())) << "it mends what is there";
    EXPECT_EQ(fault(), "none");
    chmod(path.c_str(), 0666);
    EXPECT_EQ(fault().find(path + ": others may write it"), 0u);
    std::filesystem::remove(path);
    std::filesystem::create_symlink("/dev/null", path);
    EXPECT_EQ(fault().find(path + ": cannot be read"), 0u);
    ASSERT_TRUE(renewLinksMark(run()));
    EXPECT_EQ(fault(), "none");
    EXPECT_FALSE(renewLinksMark(run() + "/missing"));
    EXPECT_EQ(readLinksMark(run() + "/missing").value(), std::nullopt);
}

}  // namespace
}  // namespace tessera
