/// Addresses as far as they count against each other, and rows of what came from them.
#include <gtest/gtest.h>

#include <arpa/inet.h>
#include <netinet/in.h>

#include <string>
#include <vector>

#include "common/base/SourceRows.h"

namespace tessera {
namespace {

SourceAddress of(const char* text) {
    sockaddr_in four{};
    four.sin_family = AF_INET;
    if (inet_pton(AF_INET, text, &four.sin_addr) == 1) return sourceOf(reinterpret_cast<const sockaddr&>(four));
    sockaddr_in6 six{};
    six.sin6_family = AF_INET6;
    EXPECT_EQ(inet_pton(AF_INET6, text, &six.sin6_addr), 1) << text;
    return sourceOf(reinterpret_cast<const sockaddr&>(six));
}

TEST(SourceAddress, IsAnAddressOrSixtyFourBitsOfOne) {
    EXPECT_EQ(of("192.0.2.7"), of("::ffff:192.0.2.7"));
    EXPECT_NE(of("192.0.2.7"), of("192.0.2.8"));
    EXPECT_EQ(of("2001:db8:0:1::5"), of("2001:db8:0:1:ffff::9"));
    EXPECT_NE(of("2001:db8:0:1::5"), of("2001:db8:0:2::5"));
    EXPECT_EQ(toString(of("192.0.2.7")), "192.0.2.7");
    EXPECT_EQ(toString(of("2001:db8:0:1::5")), "2001:db8:0:1::/64");
    EXPECT_TRUE(of("::1")) << "it is known";
    sockaddr local{};
    local.sa_family = AF_UNIX;
    EXPECT_FALSE(sourceOf(local));
}

TEST(SourceRows, KnowWhoIsMostCrowdedWhateverComesAndGoes) {
    SourceRows<int> rows;
    const SourceAddress a(1), b(2);
    const auto first = rows.add(a, 1);
    rows.add(b, 2);
    const auto third = rows.add(b, 3);
    EXPECT_EQ(rows.mostCrowded(), b);
    EXPECT_EQ(*rows.oldestOf(b), 2);
    EXPECT_EQ(*rows.newestOf(b), 3);
    EXPECT_EQ(rows.remove(third), 3);
    rows.add(a, 4);
    EXPECT_EQ(rows.mostCrowded(), a);
    rows.moveToEnd(first);
    EXPECT_EQ(*rows.oldestOf(a), 4);
    EXPECT_EQ(rows.countOf(a), 2u);
    EXPECT_EQ(rows.countOf(SourceAddress(3)), 0u);
    EXPECT_EQ(rows.remove(first), 1);
    EXPECT_EQ(rows.remove(rows.oldestOf(a)), 4);
    EXPECT_EQ(rows.remove(rows.oldestOf(b)), 2);
    EXPECT_TRUE(rows.empty());
}

TEST(SourceRows, OfAsManyKnowWhoCameFirst) {
    SourceRows<int> rows;
    const auto first = rows.add(SourceAddress(1), 1);
    rows.add(SourceAddress(2), 2);
    rows.add(SourceAddress(3), 3);
    EXPECT_EQ(rows.mostCrowded(), SourceAddress(1));
    rows.moveToEnd(first);
    EXPECT_EQ(rows.mostCrowded(), SourceAddress(2));
    EXPECT_EQ(*rows.oldest(), 2);
    EXPECT_EQ(rows.takeOldestOfCrowd(), 2);
    rows.add(SourceAddress(2), 4);
    rows.add(SourceAddress(1), 5);
    EXPECT_EQ(rows.takeOldestOfCrowd(), 1) << "of the most crowded";
}

TEST(SourceRows, LetAddressesTakeTurns) {
    SourceRows<std::string> rows;
    for (const char* each : {"a1", "a2", "a3"}) rows.add(SourceAddress(1), each);
    rows.add(SourceAddress(2), "b1");
    std::vector<std::string> order{rows.takeTurn()};
    rows.add(SourceAddress(3), "c1");
    while (!rows.empty()) order.push_back(rows.takeTurn());
    EXPECT_EQ(order, (std::vector<std::string>{"a1", "b1", "a2", "c1", "a3"}));
}

}  // namespace
}  // namespace tessera
