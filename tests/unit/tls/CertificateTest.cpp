#include "common/tls/Certificate.h"

#include <gtest/gtest.h>

#include <random>

#include "WallOfKeys.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;
using test::WallOfKeys;

TEST(Identity, IsReadAsItWasWritten) {
    std::mt19937 random(7);
    const auto name = [&] {
        std::string text;
        for (std::size_t i = 1 + random() % 20; i > 0; --i) text += static_cast<char>(1 + random() % 255);
        return text;
    };
    for (int round = 0; round < 2000; ++round) {
        Identity identity{.wall = name(), .kind = static_cast<Identity::Kind>(random() % 3), .name = {}};
        if (identity.kind != Identity::Kind::kServer) identity.name = name();
        if (identity.kind == Identity::Kind::kPerson) identity.role = static_cast<Role>(random() % 3);
        const std::string uri = toUri(identity);
        EXPECT_EQ(uri.find_first_of(" ,\n"), std::string::npos);
        const Expected<Identity> read = parseIdentity(uri);
        ASSERT_TRUE(read) << uri;
        EXPECT_EQ(*read, identity) << uri;
    }
}

TEST(Identity, IsNothingElse) {
    for (const char* uri :
         {"", "tessera://", "tessera://cave", "tessera://cave/", "tessera:///server", "tessera://cave/host",
          "tessera://cave/host/", "tessera://cave/host/a/b", "tessera://cave/person/anna",
          "tessera://cave/person/anna/king", "tessera://cave/person/anna/editor/", "https://cave/server",
          "tessera://c%2/server", "tessera://c%61ve/server", "tessera://c%2fe/server", "tessera://ca ve/server",
          "tessera://cave/server/x", "tessera://cave/SERVER"})
        EXPECT_FALSE(parseIdentity(uri)) << uri;
}

TEST(Certificate, SaysWhatItWasMadeFor) {
    const WallOfKeys wall("the cave, \"big\" = 5/6");
    for (const Identity& holder : {wall.server(), wall.host("left upper, 2"), wall.person("Äneas", Role::kOperator)}) {
        const Authority::Issued issued = wall.issue(holder);
        const Expected<Certificate> read = Certificate::read(issued.pem);
        ASSERT_TRUE(read) << read.error().message;
        EXPECT_EQ(read->holder, holder);
        EXPECT_EQ(read->serial, issued.certificate.serial);
        EXPECT_EQ(read->serial.size(), 32u);
        EXPECT_EQ(read->fingerprint.size(), 64u);
        EXPECT_NEAR(std::chrono::duration<double>(read->until - read->from).count(),
                    std::chrono::duration<double>(Authority::kServes + Authority::kBefore).count(), 2);
    }
    const Expected<Certificate> authority = Certificate::read(wall.authority().certificatePem());
    ASSERT_TRUE(authority);
    EXPECT_FALSE(authority->holder);  // whoever has it alone is nobody
    const Expected<Authority> again = Authority::read(wall.authority().pem());
    ASSERT_TRUE(again) << again.error().message;
    EXPECT_EQ(again->wall(), wall.authority().wall());
    EXPECT_EQ(again->certificate().fingerprint, wall.authority().certificate().fingerprint);
}

TEST(Certificate, DoesNotOutliveItsAuthority) {
    const WallOfKeys wall;
    const Authority::Issued issued = wall.issue(wall.host("left"), 0s, 365'000h);
    EXPECT_EQ(issued.certificate.until, wall.authority().certificate().until);
}

TEST(Authority, IssuesForItsWallAloneAndNoStrangeNames) {
    const WallOfKeys wall;
    const auto now = std::chrono::system_clock::now();
    EXPECT_FALSE(wall.authority().issue(WallOfKeys("dome").host("left"), {}, now));
    for (const char* name : {"", "a b", "x,URI:tessera://cave/server", "wall\nhost", "*"})
        EXPECT_FALSE(wall.authority().issue(wall.server(), {name}, now)) << name;
    EXPECT_TRUE(wall.authority().issue(wall.server(), {"wall-3.example.org", "10.0.0.7", "::1", "fe80::1"}, now));
    EXPECT_FALSE(Authority::read(wall.issue(wall.host("left")).pem));
    EXPECT_FALSE(Authority::read(wall.authority().certificatePem()));
    EXPECT_FALSE(Authority::read("rubbish"));
    EXPECT_FALSE(Certificate::read(""));
}

}  // namespace
}  // namespace tessera
