#include "common/tls/KeyFolder.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <thread>

#include "WallOfKeys.h"
#include "common/base/Channel.h"
#include "common/tls/KeyRing.h"
#include "tests/support/words/Words.h"
#include "tests/unit/Eventually.h"
#include "tests/unit/TestFolder.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;
using test::eventually;
using test::TestFolder;
using test::WallOfKeys;

struct Keys {
    Keys() : folder(place / "keys") {
        {
            auto writer = KeyFolder::Writer::open(folder);
            EXPECT_TRUE(writer) << writer.error().message;
            EXPECT_TRUE(writer->write("authority.crt", wall.authority().certificatePem()));
        }
        put(wall.server());
    }
    void put(const Identity& holder) {
        auto writer = KeyFolder::Writer::open(folder);
        const Authority::Issued key = wall.issue(holder);
        issued.push_back({key.certificate.serial, holder, key.certificate.until});
        ASSERT_TRUE(writer->write(issued));
        ASSERT_TRUE(writer->write(KeyFolder::fileOf(holder), key.pem));
    }
    void revokeLast() {
        issued.back().revoked = true;
        ASSERT_TRUE(KeyFolder::Writer::open(folder)->write(issued));
    }

    TestFolder place;
    WallOfKeys wall;
    KeyFolder folder;
    std::vector<IssuedKey> issued;
};

std::optional<ErrorCode> faultOf(const Expected<TlsKeys>& keys) {
    return keys ? std::nullopt : std::optional(keys.error().code);
}

TEST(KeyFolder, HasWhatWasWritten) {
    Keys keys;
    keys.put(keys.wall.host("left"));
    keys.put(keys.wall.person("anna b", Role::kEditor));
    keys.revokeLast();
    const auto issued = keys.folder.issued();
    ASSERT_TRUE(issued) << issued.error().message;
    ASSERT_EQ(issued->size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ((*issued)[i].serial, keys.issued[i].serial);
        EXPECT_EQ((*issued)[i].holder, keys.issued[i].holder);
        EXPECT_EQ((*issued)[i].revoked, i == 2);
    }
    const auto server = keys.folder.ofServer();
    ASSERT_TRUE(server) << server.error().message;
    EXPECT_EQ(server->revoked, std::set<std::string>{keys.issued[2].serial});
    EXPECT_TRUE(TlsContext::make(*server));
    EXPECT_TRUE(keys.folder.ofHost("left"));
    EXPECT_EQ(faultOf(keys.folder.ofHost("right")), ErrorCode::kNotFound);
    EXPECT_TRUE(keys.folder.ofPerson(""));
    keys.put(keys.wall.person("bob", Role::kViewer));
    EXPECT_EQ(faultOf(keys.folder.ofPerson("")), ErrorCode::kUsage);
    EXPECT_TRUE(keys.folder.ofPerson("bob"));
}

TEST(KeyFolder, TakesNothingThatOthersMayRead) {
    Keys keys;
    const std::string file = keys.folder.path() + "/server.pem";
    struct stat info {};
    ASSERT_EQ(stat(file.c_str(), &info), 0);
    EXPECT_EQ(info.st_mode & 07777u, 0600u);
    ASSERT_EQ(stat(keys.folder.path().c_str(), &info), 0);
    EXPECT_EQ(info.st_mode & 07777u, 0700u);
    ASSERT_EQ(chmod(file.c_str(), 0640), 0);
    const auto read = keys.folder.ofServer();
    ASSERT_FALSE(read);
    EXPECT_EQ(read.error().code, ErrorCode::kRefused);
    EXPECT_WORDS(read.error().message);
    ASSERT_EQ(chmod(keys.folder.path().c_str(), 0750), 0);
    EXPECT_FALSE(KeyFolder::Writer::open(keys.folder));
}

/// What is missing may have said who was revoked.
TEST(KeyFolder, ATornListOfKeysIsNone) {
    Keys keys;
    keys.put(keys.wall.host("left"));
    keys.revokeLast();
    const std::string file = keys.folder.path() + "/issued";
    std::ifstream in(file);
    const std::string whole{std::istreambuf_iterator<char>(in), {}};
    ASSERT_TRUE(keys.folder.ofServer());
    for (std::size_t cut = 0; cut < whole.size(); ++cut) {
        std::ofstream(file) << whole.substr(0, cut);
        EXPECT_FALSE(keys.folder.ofServer()) << cut;
    }
    for (const char* line : {"x", "ab tessera://cave/server", "ab tessera://cave/king 5", "",
                             "ab tessera://cave/server 5 revokedx", "ab tessera://cave/server 5 revoked more"}) {
        std::ofstream(file) << line << "\nend\n";
        EXPECT_FALSE(keys.folder.issued()) << line;
        EXPECT_FALSE(keys.folder.ofServer()) << line;
    }
    std::filesystem::remove(file);
    EXPECT_FALSE(keys.folder.ofServer());
}

TEST(KeyFolder, KeepsTokensAsHashes) {
    Keys keys;
    const std::string word = freshToken(), old = freshToken(), other = freshToken();
    const auto now = std::chrono::system_clock::now();
    {
        auto writer = KeyFolder::Writer::open(keys.folder);
        ASSERT_TRUE(writer);
        ASSERT_TRUE(writer->writeTokens({{hashOfToken(word), {"ci, \"nightly\"", Role::kEditor}, now + 1h},
                                         {hashOfToken(old), {"ci", Role::kOperator}, now - 1s}}));
    }
    std::ifstream file(keys.folder.path() + "/tokens");
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    EXPECT_EQ(text.find(word), std::string::npos);
    const auto context = TlsContext::make(*keys.folder.ofServer());
    ASSERT_TRUE(context);
    const std::optional<AccessPass> pass = (*context)->passOf(word, now);
    ASSERT_TRUE(pass);
    EXPECT_EQ(pass->name, "ci, \"nightly\"");
    EXPECT_EQ(pass->role, Role::kEditor);
    EXPECT_FALSE((*context)->passOf(word, now + 2h));
    for (const std::string& none : {old, other, std::string(), hashOfToken(word), word.substr(1)})
        EXPECT_FALSE((*context)->passOf(none, now));
    for (const char* torn : {"x", "ab tessera://-/person/a/editor 5", "\n"}) {
        std::ofstream(keys.folder.path() + "/tokens") << torn;
        EXPECT_FALSE(keys.folder.ofServer()) << torn;
    }
}

TEST(KeyFolder, ATokenOfAPanelIsNoneWithoutIt) {
    Keys keys;
    const auto now = std::chrono::system_clock::now();
    const std::string text = "title: \"a\"", word = freshToken(), other = freshToken();
    const std::string file = keys.folder.path() + "/panel-" + KeyFolder::panelName(text);
    {
        auto writer = KeyFolder::Writer::open(keys.folder);
        ASSERT_TRUE(writer);
        const Expected<std::string> name = writer->writePanel(text);
        ASSERT_TRUE(name);
        ASSERT_TRUE(writer->writeTokens({{hashOfToken(word), {"visitor", Role::kEditor, *name}, now + 1h},
                                         {hashOfToken(other), {"ci", Role::kViewer}, now + 1h}}));
    }
    const auto passOf = [&](const std::string& said) {
        return (*TlsContext::make(*keys.folder.ofServer()))->passOf(said, now);
    };
    ASSERT_TRUE(passOf(word));
    EXPECT_EQ(passOf(word)->panel, KeyFolder::panelName(text));
    EXPECT_EQ(*(*TlsContext::make(*keys.folder.ofServer()))->panelOf(passOf(word)->panel), text);
    EXPECT_EQ(passOf(other)->panel, "");
    // Another text, or none: nobody comes in by it, and the other tokens hold.
    const auto faults = [&] { return (*TlsContext::make(*keys.folder.ofServer()))->faults(); };
    EXPECT_TRUE(faults().empty());
    std::ofstream(file) << "title: \"b\"";
    EXPECT_FALSE(passOf(word));
    EXPECT_TRUE(passOf(other));
    const std::string words = "the token of 'visitor' lets nobody in: " + file + ": is another panel than it was";
    EXPECT_EQ(faults(), std::vector{words});
    std::filesystem::remove(file);
    EXPECT_FALSE(passOf(word));
    EXPECT_TRUE(passOf(other));
    ASSERT_EQ(faults().size(), 1u);
    EXPECT_NE(faults()[0].find("panel-"), std::string::npos) << faults()[0];
}

TEST(KeyFolder, SaysWhichKeysEndSoon) {
    Keys keys;
    keys.put(keys.wall.host("left"));
    keys.put(keys.wall.host("right"));
    const auto now = std::chrono::system_clock::now();
    keys.issued[0].until = now + std::chrono::days(300);  // the server's
    keys.issued[1].until = now + std::chrono::days(12) + 1h;
    keys.issued[2].until = now - 1h;
    keys.revokeLast();  // nobody renews it
    auto context = TlsContext::make(*keys.folder.ofServer());
    ASSERT_TRUE(context);
    ASSERT_EQ((*context)->endsSoon(now).size(), 1u);
    EXPECT_NE(toText((*context)->endsSoon(now)[0], now).find("the host 'left' of the wall 'cave' ends on"),
              std::string::npos);
    EXPECT_NE(toText((*context)->endsSoon(now)[0], now).find("in 12 days"), std::string::npos);
    keys.put(keys.wall.host("left"));  // renewed
    context = TlsContext::make(*keys.folder.ofServer());
    ASSERT_TRUE(context);
    EXPECT_TRUE((*context)->endsSoon(now).empty());
    EXPECT_EQ((*context)->ends().front().holder, keys.wall.server());
}

struct Watched : Keys {
    Watched() {
        put(wall.host("left"));
        left = *Certificate::read(folder.ofHost("left")->own);
        auto opened = KeyRing::open(folder.path(), [this] { return folder.ofServer(); });
        EXPECT_TRUE(opened) << opened.error().message;
        ring = std::move(*opened);
        ring->watch([] {}, [this](const std::string& text) { words.tryPush(text); });
    }
    /// It looks four times a second.
    bool revokedSoon(std::chrono::milliseconds patience = 10s) const {
        return eventually([&] { return !ring->current()->faultOf(left, std::chrono::system_clock::now(), {}).empty(); },
                          patience);
    }
    /// Waits until it says something in which all these are.
    bool says(const std::vector<std::string>& parts) {
        const auto isIn = [&](const std::string& said) {
            return std::ranges::all_of(parts,
                                       [&](const std::string& part) { return said.find(part) != std::string::npos; });
        };
        while (const std::optional<std::string> said = words.popFor(10s))
            if (isIn(*said)) return true;
        return false;
    }
    Certificate left;
    Channel<std::string> words{100};
    std::unique_ptr<KeyRing> ring;
};

TEST(KeyRing, SeesWhatIsRevokedAndKeepsItsKeysOverWhatIsTorn) {
    Watched keys;
    const auto before = keys.ring->current();
    std::ofstream(keys.folder.path() + "/issued") << "rubbish";
    const std::optional<std::string> said = keys.words.popFor(10s);
    ASSERT_TRUE(said);
    EXPECT_NE(said->find("issued"), std::string::npos);
    EXPECT_EQ(keys.ring->current(), before);
    EXPECT_FALSE(keys.words.popFor(600ms)) << "it is said once";
    keys.revokeLast();
    EXPECT_TRUE(keys.revokedSoon());
}

/// Whatever is wrong with the other files: who reads "revoked" believes it.
TEST(KeyRing, WhatIsRevokedCountsWhereTheWholeCannotBeRead) {
    const auto text = [](const std::string& file) {
        std::ifstream in(file);
        return std::string{std::istreambuf_iterator<char>(in), {}};
    };
    struct Case {
        std::string file;
        std::function<void(const std::string&)> spoil;
    };
    const std::vector<Case> cases{
        {"server.pem", [](const std::string& file) { ASSERT_EQ(::chmod(file.c_str(), 0640), 0); }},
        {"server.pem", [&](const std::string& file) { std::ofstream(file) << text(file + ".kept").substr(0, 600); }},
        {"authority.crt", [](const std::string& file) { std::filesystem::remove(file); }},
    };
    for (const Case& each : cases) {
        SCOPED_TRACE(each.file);
        Watched keys;
        const auto now = std::chrono::system_clock::now();
        const std::string word = freshToken(), other = freshToken(), late = freshToken();
        const KeptToken first{hashOfToken(word), {"ci", Role::kEditor}, now + 1h};
        const KeptToken second{hashOfToken(other), {"ci", Role::kViewer}, now + 1h};
        const KeptToken third{hashOfToken(late), {"ci", Role::kViewer}, now + 1h};
        const auto lets = [&](const std::string& said) { return keys.ring->current()->passOf(said, now).has_value(); };
        const auto writesTokens = [&](const std::vector<KeptToken>& tokens) {
            ASSERT_TRUE(KeyFolder::Writer::open(keys.folder)->writeTokens(tokens));
        };
        writesTokens({first, second});
        ASSERT_TRUE(eventually([&] { return lets(word) && lets(other); }));
        const std::string file = keys.folder.path() + "/" + each.file;
        std::filesystem::copy_file(file, file + ".kept");
        each.spoil(file);
        const std::optional<std::string> said = keys.words.popFor(10s);
        ASSERT_TRUE(said);
        EXPECT_NE(said->find(file), std::string::npos) << *said;
        EXPECT_FALSE(keys.revokedSoon(0ms)) << "the keys stay";
        EXPECT_TRUE(lets(word) && lets(other));
        EXPECT_TRUE(keys.ring->current()->mayAccept());

        keys.revokeLast();
        EXPECT_TRUE(keys.revokedSoon());
        writesTokens({second, third});
        EXPECT_TRUE(eventually([&] { return !lets(word); }));
        EXPECT_TRUE(lets(other));
        EXPECT_FALSE(lets(late)) << "nobody comes in who was not let in";
        // Nobody comes back by what is torn, or by an older list.
        std::ofstream(keys.folder.path() + "/tokens") << "rubbish";
        std::ofstream(keys.folder.path() + "/issued") << "rubbish";
        EXPECT_TRUE(keys.says({keys.folder.path() + "/tokens", keys.folder.path() + "/issued"}));
        EXPECT_FALSE(lets(word));
        EXPECT_TRUE(lets(other));
        EXPECT_TRUE(keys.revokedSoon(0ms));
        keys.issued.back().revoked = false;
        ASSERT_TRUE(KeyFolder::Writer::open(keys.folder)->write(keys.issued));
        writesTokens({first, second, third});
        EXPECT_TRUE(keys.says({"but for what is revoked"})) << "both lists can be read again";
        EXPECT_TRUE(keys.revokedSoon(0ms));
        EXPECT_FALSE(lets(word));
        EXPECT_TRUE(lets(other));
        // What can be read again counts as it stands there.
        std::filesystem::rename(file + ".kept", file);
        EXPECT_TRUE(eventually([&] { return lets(word) && lets(late); }));
        EXPECT_FALSE(keys.revokedSoon(0ms));
    }
}

/// By its name: a folder that is put in its place counts.
TEST(KeyRing, SeesAFolderThatHasBeenReplaced) {
    Watched keys;
    std::filesystem::rename(keys.folder.path(), keys.place / "old");
    std::filesystem::copy(keys.place / "old", keys.folder.path());
    std::filesystem::permissions(keys.folder.path(), std::filesystem::perms::owner_all);
    keys.revokeLast();
    EXPECT_TRUE(keys.revokedSoon());
}

TEST(KeyRing, SeesThatAFileMayBeReadAgain) {
    Watched keys;
    const std::string file = keys.folder.path() + "/server.pem";
    ASSERT_EQ(chmod(file.c_str(), 0644), 0);
    ASSERT_TRUE(keys.words.popFor(10s));
    keys.revokeLast();
    EXPECT_TRUE(keys.revokedSoon()) << "of what cannot be read";
    const auto before = keys.ring->current();
    ASSERT_EQ(chmod(file.c_str(), 0600), 0);
    EXPECT_TRUE(eventually([&] { return keys.ring->current() != before; })) << "it is read again";
    EXPECT_TRUE(keys.revokedSoon(0ms));
}

/// Whatever else is written there meanwhile, without a pause.
TEST(KeyRing, ARevocationDoesNotWaitForQuiet) {
    Watched keys;
    std::jthread busy([&](const std::stop_token& done) {
        for (int i = 0; !done.stop_requested(); ++i) std::ofstream(keys.folder.path() + "/other") << i;
    });
    keys.revokeLast();
    EXPECT_TRUE(keys.revokedSoon());
}

TEST(KeyRing, SaysWhichFileIsCut) {
    for (const std::string name : {"server.pem", "authority.crt"}) {
        Keys keys;
        const std::string file = keys.folder.path() + "/" + name;
        std::ifstream in(file);
        const std::string whole{std::istreambuf_iterator<char>(in), {}};
        for (const std::size_t cut : {std::size_t{0}, std::size_t{100}, whole.size() - 20}) {
            std::ofstream(file) << whole.substr(0, cut);
            const auto ring = KeyRing::open(keys.folder.path(), [&] { return keys.folder.ofServer(); });
            ASSERT_FALSE(ring) << cut;
            EXPECT_TRUE(ring.error().message.starts_with(file + ": ")) << ring.error().message;
        }
    }
}

TEST(KeyRing, SaysWhichKeysAreMissing) {
    TestFolder place;
    const KeyFolder none(place / "none");
    const auto ring = KeyRing::open(none.path(), [&] { return none.ofServer(); });
    ASSERT_FALSE(ring);
    EXPECT_EQ(ring.error().code, ErrorCode::kNotFound);
    EXPECT_WORDS(ring.error().message);
}

}  // namespace
}  // namespace tessera
