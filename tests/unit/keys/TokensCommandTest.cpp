/// Tokens of tessera-keys: shown once, kept as hashes, of roles and of panels.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

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

}  // namespace
}  // namespace tessera
