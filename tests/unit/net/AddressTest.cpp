#include <gtest/gtest.h>

#include "common/net/Transport.h"
#include "tests/support/words/Words.h"

namespace tessera {
namespace {

TEST(Address, IsReadAndWritten) {
    for (const char* text : {"127.0.0.1:7000", "[::1]:7000", "wallhost:7000", "10.0.0.255:0", "[fe80::1%eth0]:65535"}) {
        const auto address = parseAddress(text);
        ASSERT_TRUE(address) << text;
        EXPECT_EQ(toString(*address), text);
    }
    EXPECT_EQ(parseAddress("[::1]:7000")->host, "::1");
}

TEST(Address, NonsenseIsExplained) {
    const auto why = [](std::string_view text) {
        const auto address = parseAddress(text);
        return address ? std::string("accepted") : address.error().message;
    };
    EXPECT_WORDS(why("wallhost"));
    EXPECT_WORDS(why(":7000"));
    EXPECT_WORDS(why("::1:7000"));
    EXPECT_WORDS(why("[::1:7000"));
    for (const char* text : {"a:", "a:65536", "a:-1", "a:7x", "a: 7"}) EXPECT_WORDS(why(text));
    // A page's link, which somebody took for an address: its token does not go into logs.
    for (const char* text :
         {"http://127.0.0.1:7001/?token=secret", "127.0.0.1:7001/?token=secret", "a:7001?token=secret"})
        EXPECT_EQ(why(text).find("secret"), std::string::npos) << why(text);
    EXPECT_WORDS(why(std::string(5000, 'a')));
}

TEST(Address, KnowsLoopback) {
    for (const char* host : {"localhost", "127.0.0.1", "127.9.9.9", "::1"})
        EXPECT_TRUE((Address{host, 1}.isLoopback())) << host;
    for (const char* host : {"0.0.0.0", "::", "10.0.0.1", "wallhost", ""})
        EXPECT_FALSE((Address{host, 1}.isLoopback())) << host;
}

}  // namespace
}  // namespace tessera
