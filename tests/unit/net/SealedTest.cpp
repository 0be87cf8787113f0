/// Links of a Transport that are sealed (TLS 1.3).
#include <gtest/gtest.h>

#include <deque>
#include <random>

#include "Peers.h"
#include "common/net/Transport.h"
#include "tests/support/words/Words.h"
#include "tests/unit/Eventually.h"
#include "tests/unit/HistoryLiterals.h"
#include "tests/unit/tls/WallOfKeys.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;
using link_event::Closed;
using link_event::Opened;
using link_event::Received;
using link_event::Secured;
using test::BareSocket;
using test::frameBytes;
using test::pattern;
using test::Peer;
using test::WallOfKeys;

using Context = std::shared_ptr<const TlsContext>;

const WallOfKeys& wall() {
    static const WallOfKeys keys;
    return keys;
}
TransportLimits with(Context keys) {
    TransportLimits limits;
    limits.tls = [keys = std::move(keys)] { return keys; };
    return limits;
}
TransportLimits asServer() {
    return with(test::contextOf(wall().keysOf(wall().server())));
}
TransportLimits asHost(const std::string& name = "left") {
    return with(test::contextOf(wall().keysOf(wall().host(name))));
}

TEST(SealedLinks, CarryFramesBothWaysInOrder) {
    Peer server(asServer()), client(asHost());
    const LinkId link = client->connect({"127.0.0.1", server.listen()}, 5s);
    const LinkId accepted = server.next<Opened>().link;
    for (std::uint16_t i = 1; i <= 99; ++i) client->send(link, i, Epoch(1000u + i), share(pattern(i * 370u, i)));
    const Secured secured = server.next<Secured>();
    EXPECT_EQ(secured.link, accepted);
    ASSERT_TRUE(secured.peer);
    EXPECT_EQ(secured.peer->identity, wall().host("left"));
    EXPECT_EQ(secured.peer->fault, "");
    for (std::uint16_t i = 1; i <= 99; ++i) {
        const Received frame = server.next<Received>();
        EXPECT_EQ(frame.link, accepted);
        EXPECT_EQ(frame.type, i);
        EXPECT_EQ(frame.epoch, Epoch(1000u + i));
        EXPECT_EQ(frame.payload, pattern(i * 370u, i));
    }
    server->send(accepted, 5, 1_epoch, ByteSlice());
    EXPECT_TRUE(client.next<Received>().payload.empty());
    const Bytes large = pattern(50'000'000);
    server->send(accepted, 6, 1_epoch, share(large));
    EXPECT_EQ(client.next<Received>().payload, large);
    client->send(link, 7, 1_epoch, share(large));
    EXPECT_EQ(server.next<Received>().payload, large);
}

TEST(SealedLinks, StandBesidePlainOnesAtTheSameListener) {
    Peer server(asServer()), sealed(asHost()), plain;
    const std::uint16_t port = server.listen();
    const LinkId a = sealed->connect({"127.0.0.1", port}, 5s), b = plain->connect({"127.0.0.1", port}, 5s);
    plain->send(b, 2, 1_epoch, share(pattern(10)));
    const Received first = server.next<Received>();
    EXPECT_EQ(first.type, 2);
    sealed->send(a, 3, 1_epoch, share(pattern(10)));
    const Received second = server.next<Received>();
    EXPECT_EQ(second.type, 3);
    EXPECT_NE(first.link, second.link);
    server->send(first.link, 4, 1_epoch, share(pattern(5)));
    server->send(second.link, 5, 1_epoch, share(pattern(5)));
    EXPECT_EQ(plain.next<Received>().type, 4);
    EXPECT_EQ(sealed.next<Received>().type, 5);
}

/// Nothing of ours is read by who has not proved to be the server.
TEST(SealedLinks, AServerThatIsNotBelievedHearsNothing) {
    const WallOfKeys twin;
    Peer server(with(test::contextOf(twin.keysOf(twin.server())))), client(asHost());
    const LinkId link = client->connect({"127.0.0.1", server.listen()}, 5s);
    client->send(link, 9, 1_epoch, share(pattern(100)));
    const Closed closed = client.next<Closed>();
    EXPECT_EQ(closed.code, ErrorCode::kRefused);
    EXPECT_WORDS(closed.reason);
    for (;;) {
        const auto event = server.any(5s);
        ASSERT_TRUE(event);
        ASSERT_FALSE(std::holds_alternative<Received>(event->what));
        if (const auto* end = std::get_if<Closed>(&event->what)) {
            EXPECT_WORDS(end->reason);
            break;
        }
    }
}

TEST(SealedLinks, WhoeverHasNoKeysSaysSo) {
    Peer server, client(asHost());
    client->connect({"127.0.0.1", server.listen()}, 5s);
    EXPECT_WORDS(server.next<Closed>().reason);
    const Closed closed = client.next<Closed>();
    EXPECT_EQ(closed.code, ErrorCode::kNetwork);  // it may get some
    EXPECT_WORDS(closed.reason);
}

TEST(SealedLinks, RubbishAndHalfHandshakesEndTheirOwnLinkAlone) {
    TransportLimits limits = asServer();
    limits.handshakeTime = 300ms;
    Peer server(std::move(limits)), client(asHost());
    const std::uint16_t port = server.listen();
    const LinkId link = client->connect({"127.0.0.1", port}, 5s);
    client->send(link, 1, 1_epoch, share(pattern(10)));
    server.next<Received>();
    BareSocket rubbish(port);
    Bytes bytes = pattern(5000);
    bytes[0] = std::byte{0x16};
    rubbish.say(bytes);
    EXPECT_NE(server.next<Closed>().reason.find("handshake"), std::string::npos);
    BareSocket half(port);
    half.say(std::string_view("\x16\x03\x01\x01\x00", 5));  // and 256 bytes that do not come
    EXPECT_WORDS(server.next<Closed>().reason);
    client->send(link, 2, 1_epoch, share(pattern(10)));
    EXPECT_EQ(server.next<Received>().type, 2);
}

TEST(SealedLinks, ClosingSendsWhatIsQueued) {
    Peer server(asServer()), client(asHost());
    const LinkId link = client->connect({"127.0.0.1", server.listen()}, 5s);
    const Bytes large = pattern(20'000'000);
    client.next<Opened>();  // and the handshake has not ended
    client->send(link, 1, 1_epoch, share(large));
    client->close(link, "done");
    EXPECT_EQ(server.next<Received>().payload, large);
    EXPECT_EQ(server.next<Closed>().reason, "the peer closed the connection");
    EXPECT_EQ(client.next<Closed>().reason, "done");
}

TEST(SealedLinks, WhatIsNotTakenIsNotRead) {
    TransportLimits limits = asServer();
    limits.maxUntakenBytes = 1'000'000;
    Peer server(std::move(limits)), client(asHost());
    const LinkId link = client->connect({"127.0.0.1", server.listen()}, 5s);
    constexpr int kCount = 400;
    for (int i = 0; i < kCount; ++i) client->send(link, 1, 1_epoch, share(pattern(100'000, static_cast<unsigned>(i))));
    std::deque<Received> handedOut;
    for (; auto event = server.any(300ms);)
        if (auto* frame = std::get_if<Received>(&event->what)) handedOut.push_back(std::move(*frame));
    EXPECT_LE(handedOut.size(), 12u) << "the bound, and a message or two above it";
    EXPECT_GT(client->queuedBytes(link), 10'000'000u);  // TCP takes some
    for (int i = 0; i < kCount; ++i) {
        Received frame;
        if (handedOut.empty()) {
            frame = server.next<Received>();
        } else {
            frame = std::move(handedOut.front());
            handedOut.pop_front();
        }
        ASSERT_EQ(frame.payload, pattern(100'000, static_cast<unsigned>(i)));
        server->taken(frame.link, frame.payload.size());
    }
}

TEST(SealedLinks, EndAtOnceWhenTheirKeyIsRevoked) {
    const Authority::Issued key = wall().issue(wall().host("left"));
    TlsKeys keys = wall().keysOf(wall().server());
    Channel<Context> current(8);
    Context now = test::contextOf(keys);
    TransportLimits limits;
    limits.tls = [&] {
        while (auto next = current.tryPop()) now = *next;
        return now;
    };
    Peer server(std::move(limits)), left(with(test::contextOf(wall().keysWith(key.pem)))), right(asHost("right"));
    const std::uint16_t port = server.listen();
    const LinkId l = left->connect({"127.0.0.1", port}, 5s), r = right->connect({"127.0.0.1", port}, 5s);
    left->send(l, 1, 1_epoch, share(pattern(10)));
    right->send(r, 1, 1_epoch, share(pattern(10)));
    server.next<Received>();
    server.next<Received>();
    keys.revoked.insert(key.certificate.serial);
    current.push(test::contextOf(keys));
    server->judgeAgain();
    EXPECT_WORDS(server.next<Closed>().reason);
    left.next<Closed>();
    right->send(r, 2, 1_epoch, share(pattern(10)));
    EXPECT_EQ(server.next<Received>().type, 2);
    // And whoever comes back with the ticket from before.
    const LinkId again = left->connect({"127.0.0.1", port}, 5s);
    left->send(again, 3, 1_epoch, share(pattern(10)));
    const Secured secured = server.next<Secured>();
    ASSERT_TRUE(secured.peer);
    EXPECT_WORDS(secured.peer->fault);
}

TEST(SealedLinks, ATransportEndsWhileHandshakesAreUnderWay) {
    std::mt19937 random(1);
    for (int round = 0; round < 20; ++round) {
        Peer server(asServer());
        const std::uint16_t port = server.listen();
        Peer client(asHost());
        for (int i = 0; i < 8; ++i) {
            const LinkId link = client->connect({"127.0.0.1", port}, 5s);
            client->send(link, 1, 1_epoch, share(pattern(1000)));
        }
        test::aMoment(random, 6ms);
    }
}

/// As bulk connections do, which follow their control connection.
TEST(SealedLinks, ASecondOneToAServerGoesOnWithTheSession) {
    Peer server(asServer()), client(asHost());
    const std::uint16_t port = server.listen();
    for (int i = 0; i < 3; ++i) {
        client->connect({"127.0.0.1", port}, 5s);
        const LinkId accepted = server.next<Secured>().link;
        server->send(accepted, 1, 1_epoch, share(pattern(10)));  // behind the ticket
        client.next<Received>();
    }
    EXPECT_EQ(server->traffic().handshakes, 3u);
    EXPECT_EQ(server->traffic().resumed, 2u);
}

TEST(SealedLinks, AKeptAliveOneIsHeardOf) {
    Peer server(asServer()), client(asHost());
    const LinkId link = client->connect({"127.0.0.1", server.listen()}, 5s);
    client->send(link, 1, 1_epoch, share(pattern(10)));
    server.next<Received>();
    client->keepAlive(link, 20ms, 7, 1_epoch, share(ByteChain()));
    for (int i = 0; i < 3; ++i) EXPECT_EQ(server.next<Received>().type, 7);
}

}  // namespace
}  // namespace tessera
