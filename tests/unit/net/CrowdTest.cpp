/// Who gives way to whom, and whose turn it is.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "Peers.h"
#include "common/net/Crowd.h"
#include "common/net/HandshakeTurns.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;
using link_event::Received;
using test::BareSocket;
using test::frameBytes;
using test::pattern;
using test::Peer;

constexpr SourceAddress kA(1), kB(2), kC(3);
constexpr TimePoint kStart{1h};
const auto kNobodyWaits = [](int) { return false; };

TEST(Crowd, GivesWayAtOnceToWhoComesFromALessCrowdedAddress) {
    Crowd<int> crowd(100ms);
    for (int i = 0; i < 10; ++i) crowd.add(kA, i, kStart);
    EXPECT_EQ(crowd.givesWayTo(kB, kStart, kNobodyWaits), 9) << "the last of them";
    EXPECT_FALSE(crowd.givesWayTo(kA, kStart + 99ms, kNobodyWaits)) << "who comes from there waits";
    EXPECT_EQ(crowd.givesWayTo(kA, kStart + 100ms, kNobodyWaits), 0);
    for (int i = 20; i < 29; ++i) crowd.add(kB, i, kStart);
    EXPECT_FALSE(crowd.givesWayTo(kB, kStart, kNobodyWaits)) << "nothing would be gained";
    EXPECT_EQ(crowd.givesWayTo(kC, kStart, kNobodyWaits), 9);
}

TEST(Crowd, WhereNoAddressIsCrowdedEachHasItsTime) {
    Crowd<int> crowd(100ms);
    std::vector<Crowd<int>::Place> places;
    for (int i = 0; i < 8; ++i) places.push_back(crowd.add(kA, i, kStart + i * 1ms));
    EXPECT_FALSE(crowd.givesWayTo(kB, kStart + 99ms, kNobodyWaits));
    EXPECT_EQ(crowd.due(), kStart + 100ms);
    EXPECT_EQ(crowd.givesWayTo(kB, kStart + 100ms, kNobodyWaits), 0);
    EXPECT_EQ(crowd.givesWay(kStart + 100ms, kNobodyWaits), 0);
    crowd.beginAgain(places[0], kStart + 100ms);
    EXPECT_EQ(crowd.due(), kStart + 101ms);
    crowd.remove(places[1]);
    EXPECT_EQ(crowd.due(), kStart + 102ms);
}

/// A crowd of many addresses: whoever is fresh in it keeps nobody from giving way whose time is over.
TEST(Crowd, WhoHasHadItsTimeGivesWayWhereverItIsFrom) {
    Crowd<int> crowd(100ms);
    for (int i = 0; i < 50; ++i) crowd.add(SourceAddress(100 - i), i, kStart + i * 1ms);
    for (int i = 50; i < 58; ++i) crowd.add(kA, i, kStart + 99ms);
    EXPECT_EQ(crowd.due(), kStart + 100ms);
    EXPECT_FALSE(crowd.givesWayTo(kB, kStart + 99ms, kNobodyWaits));
    EXPECT_EQ(crowd.givesWayTo(kB, kStart + 100ms, kNobodyWaits), 0);
}

TEST(Crowd, WhoWaitsForUsIsNotSilent) {
    Crowd<int> crowd(100ms);
    for (int i = 0; i < 3; ++i) crowd.add(kA, i, kStart);
    const auto firstWaits = [](int who) { return who == 0; };
    EXPECT_FALSE(crowd.givesWay(kStart + 100ms, firstWaits));
    EXPECT_EQ(crowd.givesWay(kStart + 100ms, firstWaits), 1);
    EXPECT_EQ(crowd.size(), 3u) << "whoever asks removes";
}

TEST(HandshakeTurns, AddressesTakeTurnsAndSoDoThoseWhoGoOn) {
    HandshakeTurns turns;
    std::string order;
    const auto push = [&](SourceAddress from, bool goesOn, char name) {
        turns.push(from, goesOn, [&order, name] { order += name; });
    };
    for (const char name : {'a', 'b', 'c', 'd'}) push(kA, false, name);
    push(kB, false, 'x');
    push(kA, true, '1');
    push(kA, true, '2');
    push(kC, true, '3');
    while (const auto work = turns.tryPop()) (*work)();
    EXPECT_EQ(order, "1a3x2bcd");
    push(kA, false, 'e');
    (*turns.tryPop())();
    EXPECT_EQ(order, "1a3x2bcde");
    turns.close();
    push(kA, false, 'f');
    EXPECT_FALSE(turns.tryPop());
}

/// However many come from one address, and whatever time each of them has.
TEST(Transport, AnAddressThatIsCrowdedKeepsNoOtherOneWaiting) {
    TransportLimits limits;
    limits.maxStrangers = 16;
    limits.patience = 10min;
    Peer server(std::move(limits));
    const std::uint16_t port = server.listen();
    std::vector<BareSocket> crowd;
    for (int i = 0; i < 100; ++i) crowd.emplace_back(port, "127.0.0.2");
    for (std::uint16_t i = 1; i <= 20; ++i) {
        BareSocket other(port, "127.0.0.3");
        other.say(frameBytes(i, pattern(3)));
        EXPECT_EQ(server.next<Received>().type, i);
    }
    // Who speaks makes room for the next of its address.
    for (BareSocket& each : crowd) each.say(frameBytes(50, pattern(3)));
    for (int i = 0; i < 8; ++i) EXPECT_EQ(server.next<Received>().type, 50);
}

/// Each byte of a handshake is a step that may begin its time anew.
TEST(Crowd, WhoSaysAByteAtATimeHoldsNoPlaceByThat) {
    Crowd<int> crowd(100ms);
    const Crowd<int>::Place drips = crowd.add(kA, 1, kStart);
    std::optional<std::chrono::milliseconds> gone;
    for (auto at = 50ms; at < 10s && !gone; at += 50ms) {
        crowd.beginAgain(drips, kStart + at);
        if (crowd.givesWay(kStart + at + 49ms, kNobodyWaits)) gone = at;
    }
    ASSERT_TRUE(gone) << "it says its bytes and stays";
    EXPECT_LE(*gone, 400ms);
}

}  // namespace
}  // namespace tessera
