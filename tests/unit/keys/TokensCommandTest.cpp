/// Tokens of tessera-keys: shown once, kept as hashes, of roles and of panels.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "common/access/ChosenTokens.h"
#include "common/access/LocalWalls.h"
#include "common/access/WallProtection.h"
#include "tests/unit/keys/KeysFixture.h"

namespace tessera {
namespace {

using namespace test;

using TokensCommand = KeysCommand;

TEST_F(TokensCommand, TokensAreShownOnceAndKeptAsHashes) {
    const std::string out = said({"token", "ci", "--role", "editor", "--hours", "0.5"});
    const std::string word = out.substr(out.rfind('\n', out.size() - 2) + 1, 43);
    EXPECT_TRUE(isToken(word)) << out;
    const std::string kept = textOf(keys_ + "/tokens");
    EXPECT_TRUE(contains(kept, hashOfToken(word)));
    EXPECT_FALSE(contains(kept, word));
    EXPECT_TRUE(contains(said({"list"}), "ci"));
    said({"token", "ci", "--role", "viewer"});
    EXPECT_TRUE(contains(said({"revoke", "ci"}), "revoked 2 tokens of 'ci'"));
    EXPECT_EQ(textOf(keys_ + "/tokens"), "end\n");
    EXPECT_TRUE(contains(refusal(3, {"revoke", "token/ci"}), "nobody called"));
    EXPECT_TRUE(contains(refusal(2, {"token", "ci"}), "--role"));
    EXPECT_TRUE(contains(refusal(2, {"token", "a/b", "--role", "viewer"}), "is no name"));
    EXPECT_TRUE(contains(refusal(2, {"token", "ci", "--role", "viewer", "--hours", "0"}), "--hours"));
    // A person's key goes with their tokens.
    said({"person", "ada", "--role", "editor"});
    said({"token", "ada", "--role", "editor"});
    EXPECT_TRUE(contains(said({"revoke", "ada"}), "revoked 1 token of 'ada'\nrevoked 'ada'"));
}

TEST_F(TokensCommand, ATokenOfAPanelBringsThePanelAmongTheKeys) {
    const std::string file = keys_ + "/../hall.panel";
    std::ofstream(file) << "controls { press { home: true } }";
    const auto panels = [&] {
        std::size_t count = 0;
        for (const auto& each : std::filesystem::directory_iterator(keys_))
            count += each.path().filename().string().starts_with("panel-");
        return count;
    };
    EXPECT_TRUE(contains(said({"token", "visitor", "--panel", file}), "token of 'visitor', of a panel, until"));
    EXPECT_EQ(panels(), 1u);
    EXPECT_TRUE(contains(said({"list"}), "panel"));
    said({"token", "second", "--panel", file, "--hours", "9"});
    EXPECT_EQ(panels(), 1u) << "it is the same";
    said({"revoke", "visitor"});
    EXPECT_EQ(panels(), 1u);
    said({"revoke", "second"});
    EXPECT_EQ(panels(), 0u);
    EXPECT_TRUE(contains(refusal(2, {"token", "v", "--panel", file, "--role", "viewer"}), "--role"));
    EXPECT_TRUE(contains(refusal(3, {"token", "v", "--panel", file + ".none"}), "no such panel"));
    std::ofstream(file) << "controls { pres {} }";
    EXPECT_TRUE(contains(refusal(3, {"token", "v", "--panel", file}), "hall.panel:1:12: unknown key \"pres\""));
    EXPECT_EQ(panels(), 0u);
}

/// The mark that servers look at.
std::string markIn(const std::string& folder) {
    const Expected<std::optional<std::string>> mark = readLinksMark(folder);
    EXPECT_TRUE(mark) << mark.error().message;
    return mark ? mark->value_or("") : "";
}

/// In a run folder of the test's own.
class LinksCommand : public TokensCommand {
protected:
    LinksCommand() {
        setenv("XDG_RUNTIME_DIR", around_.path().c_str(), 1);
        setenv("XDG_STATE_HOME", (around_ / "state").c_str(), 1);
    }
    ~LinksCommand() override {
        unsetenv("XDG_RUNTIME_DIR");
        unsetenv("XDG_STATE_HOME");
        std::filesystem::current_path(before_);
    }
    [[nodiscard]] std::string runFolder() const { return around_ / "tessera"; }

    std::filesystem::path before_ = std::filesystem::current_path();
};

TEST_F(LinksCommand, AllTokensAndLinksOfAWallEndAtOnce) {
    said({"token", "ci", "--role", "editor"});
    said({"token", "ci", "--role", "viewer"});
    said({"token", "ada", "--role", "operator", "--hours", "1000"});
    said({"person", "ada", "--role", "editor"});
    EXPECT_EQ(markIn(keys_), "");
    const std::string first = said({"revoke", "--links"});
    EXPECT_TRUE(contains(first, "revoked 3 tokens ('ada', 'ci') of " + keys_)) << first;
    EXPECT_TRUE(contains(first, "next: tessera-ctl link"));
    EXPECT_EQ(textOf(keys_ + "/tokens"), "end\n");
    const std::string mark = markIn(keys_);
    EXPECT_FALSE(mark.empty());
    EXPECT_EQ(modeOf(keys_ + "/links"), 0600u);
    EXPECT_EQ(stateOf("person"), "good") << "keys are no links";
    EXPECT_TRUE(contains(said({"revoke", "--links"}), "revoked no tokens of ")) << "again does no harm";
    EXPECT_NE(markIn(keys_), mark);
    EXPECT_FALSE(std::filesystem::exists(runFolder())) << "walls without keys are others";
}

TEST_F(LinksCommand, WithoutAFolderTheWallsWithoutKeysAreMeant) {
    const auto place = LocalWallPlace::take({.wall = "cave", .listen = "127.0.0.1:7000"}).value();
    ASSERT_TRUE(place->tell({"127.0.0.1", 7000}, std::nullopt));
    std::filesystem::create_directory(around_ / "elsewhere");
    std::filesystem::current_path(around_ / "elsewhere");
    const Ran alone = run({"revoke", "--links"});
    EXPECT_EQ(alone.code, 0) << alone.err;
    EXPECT_TRUE(contains(alone.out, "these run now: cave (127.0.0.1:7000)")) << alone.out;
    EXPECT_TRUE(contains(alone.out, "walls with keys keep theirs: --keys DIR")) << alone.out;
    const std::string mark = markIn(runFolder());
    EXPECT_FALSE(mark.empty());
    EXPECT_EQ(markIn(keys_), "");
    std::filesystem::current_path(around_.path());  // where `keys` is
    const Ran both = run({"revoke", "--links"});
    EXPECT_EQ(both.code, 0) << both.err;
    EXPECT_NE(markIn(runFolder()), mark);
    EXPECT_NE(markIn(keys_), "");
}

/// Where no server runs, too, and whatever the machine empties afterwards.
TEST_F(LinksCommand, TokensThatPeopleChoseEndForGood) {
    const std::string word = "a-token-that-a-person-chose", other = word + "-for-a-wall-without-keys";
    const NamedServer server{"cave", "127.0.0.1:7000"};
    const WallProtection sealed{.authority = std::string(64, 'a')};
    const auto serves = [&](const std::string& token, const WallProtection& protection) {
        return ChosenTokens(protection.authority.empty() ? "" : keys_).use(token, server, protection).has_value();
    };
    EXPECT_TRUE(serves(word, sealed));
    EXPECT_TRUE(serves(other, {}));
    said({"revoke", "--links"});
    EXPECT_FALSE(serves(word, sealed));
    EXPECT_TRUE(serves(other, {})) << "walls without keys are others";
    std::filesystem::current_path(around_.path());
    EXPECT_EQ(run({"revoke", "--links"}).code, 0);
    std::filesystem::remove_all(runFolder());
    EXPECT_FALSE(serves(other, {}));
    // A file that nobody can read is named. Links end all the same.
    const std::string mark = markIn(keys_);
    std::ofstream(keys_ + "/chosen-tokens", std::ios::trunc) << "rubbish";
    EXPECT_TRUE(contains(refusal(3, {"revoke", "--links"}), "chosen-tokens:1: is damaged"));
    EXPECT_NE(markIn(keys_), mark);
}

TEST_F(LinksCommand, ItsMisuseIsNamed) {
    said({"token", "ci", "--role", "editor"});
    const std::string tokens = textOf(keys_ + "/tokens");
    EXPECT_TRUE(contains(refusal(2, {"revoke", "--links", "ci"}), "--links"));
    EXPECT_TRUE(contains(refusal(2, {"revoke", "ci", "--links"}), "--links"));
    EXPECT_TRUE(contains(refusal(2, {"revoke"}), "(NAME), or that all links and tokens end (--links)"));
    EXPECT_EQ(textOf(keys_ + "/tokens"), tokens);
    const Ran missing = run({"--keys", around_ / "missing", "revoke", "--links"});
    EXPECT_EQ(missing.code, 3);
    EXPECT_TRUE(contains(missing.err, "missing/issued is not there")) << missing.err;
    EXPECT_FALSE(std::filesystem::exists(around_ / "missing"));
    // One that a person carries: no server reads it.
    said({"person", "ada", "--role", "editor", "--out", around_ / "ada"});
    EXPECT_EQ(run({"--keys", around_ / "ada", "revoke", "--links"}).code, 3);
    EXPECT_EQ(filesIn(around_ / "ada"), (std::set<std::string>{"authority.crt", "person-ada.pem"}));
}

TEST_F(LinksCommand, FilesThatAreDamagedKeepNoTokenAlive) {
    for (const std::string file : {"/tokens", "/issued", "/links"}) {
        said({"token", "ci", "--role", "editor"});
        const std::string before = textOf(keys_ + file);
        std::ofstream(keys_ + file, std::ios::trunc) << "rubbish";
        const Ran ran = keys({"revoke", "--links"});
        EXPECT_EQ(ran.code, 0) << file << ran.err;
        EXPECT_EQ(textOf(keys_ + "/tokens"), "end\n") << file;
        EXPECT_NE(markIn(keys_), "");
        if (file == "/issued") std::ofstream(keys_ + file, std::ios::trunc) << before;
    }
}

/// A new authority in the folder of an earlier one: people who had its tokens are let in no more.
TEST_F(LinksCommand, TokensEndWithTheirAuthority) {
    said({"token", "ci", "--role", "editor"});
    for (const char* file : {"/authority.pem", "/authority.crt"}) std::filesystem::remove(keys_ + file);
    said({"init", "--wall", TESSERA_SOURCE_DIR "/deploy/walls/cave4.wall"});
    EXPECT_EQ(textOf(keys_ + "/tokens"), "end\n");
}

}  // namespace
}  // namespace tessera
