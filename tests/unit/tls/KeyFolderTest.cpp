#include "common/tls/KeyFolder.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <future>
#include <thread>

#include "WallOfKeys.h"
#include "common/tls/KeyRing.h"
#include "tests/unit/TestFolder.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;
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
    EXPECT_NE(read.error().message.find("chmod 600"), std::string::npos);
    ASSERT_EQ(chmod(keys.folder.path().c_str(), 0750), 0);
    EXPECT_FALSE(KeyFolder::Writer::open(keys.folder));
}

TEST(KeyFolder, ATornListOfKeysIsNone) {
    Keys keys;
    const std::string file = keys.folder.path() + "/issued";
    for (const char* text : {"x", "ab tessera://cave/server", "ab tessera://cave/king 5",
                             "ab tessera://cave/server 5 revokedx", "ab tessera://cave/server 5 revoked more", "\n"}) {
        std::ofstream(file) << text;
        EXPECT_FALSE(keys.folder.issued()) << text;
        EXPECT_FALSE(keys.folder.ofServer()) << text;  // it would let in who was revoked
    }
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

TEST(KeyRing, SeesWhatIsRevokedAndKeepsItsKeysOverWhatIsTorn) {
    Keys keys;
    keys.put(keys.wall.host("left"));
    auto ring = KeyRing::open(keys.folder.path(), [&] { return keys.folder.ofServer(); });
    ASSERT_TRUE(ring) << ring.error().message;
    std::promise<void> changed;
    std::promise<std::string> fault;
    int faults = 0;
    (*ring)->watch([&] { changed.set_value(); },
                   [&](const std::string& words) {
                       if (faults++ == 0) fault.set_value(words);
                   });
    const auto before = (*ring)->current();
    std::ofstream(keys.folder.path() + "/issued") << "rubbish";
    auto said = fault.get_future();
    ASSERT_EQ(said.wait_for(10s), std::future_status::ready);
    EXPECT_NE(said.get().find("issued"), std::string::npos);
    EXPECT_EQ((*ring)->current(), before);
    keys.revokeLast();
    auto done = changed.get_future();
    ASSERT_EQ(done.wait_for(10s), std::future_status::ready);
    const auto now = std::chrono::system_clock::now();
    const Certificate left = *Certificate::read(keys.folder.ofHost("left")->own);
    EXPECT_EQ(before->faultOf(left, now, {}), "");
    EXPECT_NE((*ring)->current()->faultOf(left, now, {}), "");
}

TEST(KeyRing, SaysWhichKeysAreMissing) {
    TestFolder place;
    const KeyFolder none(place / "none");
    const auto ring = KeyRing::open(none.path(), [&] { return none.ofServer(); });
    ASSERT_FALSE(ring);
    EXPECT_EQ(ring.error().code, ErrorCode::kNotFound);
    EXPECT_NE(ring.error().message.find("none"), std::string::npos) << ring.error().message;
}

}  // namespace
}  // namespace tessera
