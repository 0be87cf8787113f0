#include "common/net/Transport.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <ctime>
#include <future>
#include <set>
#include <thread>

#include "Peers.h"
#include "common/net/OwnAddress.h"
#include "tests/support/wall/ThreadShortage.h"
#include "tests/support/words/Words.h"
#include "tests/unit/HistoryLiterals.h"
#include "tests/unit/Sanitized.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;
using link_event::Closed;
using link_event::Opened;
using link_event::Received;
using test::BareSocket;
using test::frameBytes;
using test::pattern;
using test::Peer;

TEST(Transport, CarriesFramesBothWaysInOrder) {
    Peer server, client;
    const LinkId link = client->connect({"127.0.0.1", server.listen()}, 5s);
    const LinkId accepted = server.next<Opened>().link;
    for (std::uint16_t i = 1; i <= 50; ++i) client->send(link, i, Epoch(1000u + i), share(pattern(i * 37u, i)));
    for (std::uint16_t i = 1; i <= 50; ++i) {
        const Received frame = server.next<Received>();
        EXPECT_EQ(frame.link, accepted);
        EXPECT_EQ(frame.type, i);
        EXPECT_EQ(frame.epoch, Epoch(1000u + i));
        EXPECT_EQ(frame.payload, pattern(i * 37u, i));
    }
    server->send(accepted, 5, 1_epoch, ByteSlice());
    const Received back = client.next<Received>();
    EXPECT_EQ(back.link, link);
    EXPECT_TRUE(back.payload.empty());
}

TEST(Transport, SpeaksIpv6AndNames) {
    Peer server, client;
    for (const char* host : {"::1", "localhost"}) {
        const auto port = server->listen({host, 0});
        if (!port && std::string(host) == "::1") continue;  // a machine without IPv6
        ASSERT_TRUE(port) << port.error().message;
        client->connect({host, *port}, 5s);
        EXPECT_FALSE(client.next<Opened>().peer.empty());
        server.next<Opened>();
    }
}

/// Asio looks for names on a thread that it starts for the first one.
TEST(Transport, SaysWhereAMachineHasNoRoomToLookForANameAndLooksLater) {
    if (!simulation::ThreadShortage::kRefuses) GTEST_SKIP() << "a sanitizer stands where threads are refused";
    Peer server, client;
    const auto port = server->listen({"127.0.0.1", 0});
    ASSERT_TRUE(port) << port.error().message;
    {
        const simulation::ThreadShortage shortage;
        client->connect({"localhost", *port}, 5s);
        EXPECT_WORDS(client.next<Closed>().reason);
    }
    client->connect({"localhost", *port}, 5s);
    EXPECT_FALSE(client.next<Opened>().peer.empty());
}

/// A program chooses from which address of its machine it comes: each of them is near.
TEST(Transport, KnowsItsOwnMachineWhicheverOfItsAddressesAPeerComesFrom) {
    EXPECT_TRUE(isOwnAddress("127.0.0.1") && isOwnAddress("127.9.9.9") && isOwnAddress("::1"));
    EXPECT_TRUE(isOwnAddress("::ffff:127.0.0.1"));
    EXPECT_FALSE(isOwnAddress("203.0.113.9") || isOwnAddress("wall-3") || isOwnAddress(""));
    Peer server;
    const std::uint16_t port = server.listen();
    std::vector<std::string> own{"127.0.0.1", "127.0.0.9"};
    ifaddrs* all = nullptr;
    ASSERT_EQ(getifaddrs(&all), 0);
    for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next)
        if (one->ifa_addr != nullptr && one->ifa_addr->sa_family == AF_INET) {
            std::array<char, INET_ADDRSTRLEN> text{};
            inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in*>(one->ifa_addr)->sin_addr, text.data(),
                      text.size());
            own.emplace_back(text.data());
        }
    freeifaddrs(all);
    for (const std::string& from : own) {
        const int handle = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
        sockaddr_in here{}, there{};
        here.sin_family = there.sin_family = AF_INET;
        ASSERT_EQ(inet_pton(AF_INET, from.c_str(), &here.sin_addr), 1);
        there.sin_port = htons(port);
        there.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        ASSERT_EQ(::bind(handle, reinterpret_cast<const sockaddr*>(&here), sizeof here), 0) << from;
        ASSERT_EQ(::connect(handle, reinterpret_cast<const sockaddr*>(&there), sizeof there), 0) << from;
        const Opened opened = server.next<Opened>();
        EXPECT_TRUE(opened.near) << opened.peer;
        EXPECT_TRUE(opened.peer.starts_with(from + ":")) << opened.peer;
        ::close(handle);
        (void)server.next<Closed>();
    }
}

TEST(Transport, EchoesFiftyMegabytesWhole) {
    Peer server, client;
    const LinkId link = client->connect({"127.0.0.1", server.listen()}, 5s);
    const SharedBytes big = share(pattern(50u << 20));
    client->send(link, 1, 0_epoch, big);
    const Received there = server.next<Received>();
    server->send(there.link, 1, 0_epoch, there.payload);
    const Received back = client.next<Received>();
    EXPECT_TRUE(back.payload == *big);
    EXPECT_EQ(client->queuedBytes(link), 0u);
}

TEST(Transport, OneBufferGoesToManyLinks) {
    Peer server;
    const std::uint16_t port = server.listen();
    const SharedChain big = share(ByteChain(share(pattern(3u << 20))));
    std::vector<std::unique_ptr<Peer>> clients;
    for (int i = 0; i < 16; ++i) {
        clients.push_back(std::make_unique<Peer>());
        (*clients.back())->connect({"127.0.0.1", port}, 5s);
        server->send(server.next<Opened>().link, 2, 7_epoch, big);
    }
    for (const auto& client : clients) {
        const Received frame = client->next<Received>();
        ASSERT_FALSE(frame.payload.empty());
        EXPECT_TRUE(frame.payload == big->slices()[0]);
    }
}

TEST(Transport, RefusesAndTimesOutInWords) {
    Peer client;
    std::uint16_t deadPort = 0;
    {
        Peer gone;
        deadPort = gone.listen();
    }
    client->connect({"127.0.0.1", deadPort}, 5s);
    EXPECT_WORDS(client.next<Closed>().reason);

    client->connect({"no-such-host.invalid", 1}, 5s);
    EXPECT_NE(client.next<Closed>().reason.find("no-such-host.invalid:1"), std::string::npos);
}

TEST(Transport, AHostThatDoesNotAnswerIsGivenUp) {
    // A listener whose backlog is full answers nothing at all: Linux drops the SYN.
    const int fd = ::socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    ASSERT_EQ(::bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    ASSERT_EQ(::listen(fd, 0), 0);
    socklen_t length = sizeof address;
    ::getsockname(fd, reinterpret_cast<sockaddr*>(&address), &length);

    Peer client;
    std::vector<std::string> reasons;
    for (int i = 0; i < 4; ++i) client->connect({"127.0.0.1", ntohs(address.sin_port)}, 300ms);
    while (auto event = client.any(2s))
        if (const auto* closed = std::get_if<Closed>(&event->what)) {
            reasons.push_back(closed->reason);
            if (reasons.size() == 2) break;
        }
    ::close(fd);
    ASSERT_FALSE(reasons.empty());
    EXPECT_WORDS(reasons[0]);
}

/// Before it listens: many servers that start at once would take each other's.
TEST(Transport, APortThatTheSystemPicksIsNobodyElses) {
    Peer server;
    bool another = false;
    const auto port = server->listen({"127.0.0.1", 0}, [&](std::uint16_t bound) {
        const int other = ::socket(AF_INET, SOCK_STREAM, 0), yes = 1;
        ::setsockopt(other, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_port = htons(bound);
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        another = ::bind(other, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
        ::close(other);
    });
    ASSERT_TRUE(port) << port.error().message;
    EXPECT_FALSE(another);
}

TEST(Transport, AnotherServersPortIsNamed) {
    Peer first, second;
    const std::uint16_t port = first.listen();
    const auto again = second->listen({"127.0.0.1", port});
    ASSERT_FALSE(again);
    EXPECT_EQ(again.error().code, ErrorCode::kNetwork);
    EXPECT_NE(again.error().message.find("127.0.0.1:" + std::to_string(port) + ": it is held by "), std::string::npos)
        << again.error().message;
    EXPECT_NE(again.error().message.find("(pid " + std::to_string(::getpid()) + ")"), std::string::npos)
        << again.error().message;
}

TEST(Transport, RubbishClosesItsOwnLinkAndDisturbsNoOther) {
    Peer server, client;
    const std::uint16_t port = server.listen();
    const LinkId good = client->connect({"127.0.0.1", port}, 5s);
    server.next<Opened>();

    Bytes endless = frameBytes(1, {});
    std::memset(endless.data() + 8, 0xff, 4);
    Bytes damaged = frameBytes(1, pattern(100));
    damaged[60] ^= std::byte{4};
    Bytes future = frameBytes(1, {});
    future[4] = std::byte{9};
    const Bytes unknown = frameBytes(400, {});
    for (const Bytes& bytes : {pattern(5000), Bytes(64, std::byte{0}), endless, damaged, future, unknown}) {
        BareSocket bare(port);
        bare.say(bytes);
        const LinkId link = server.next<Opened>().link;
        const Closed closed = server.next<Closed>();
        EXPECT_EQ(closed.link, link);
        EXPECT_WORDS(closed.reason);
    }
    // Half a header, half a payload, nothing at all: links that end when their peers do.
    for (const std::size_t size : {0u, 10u, 100u}) {
        BareSocket bare(port);
        bare.say(ByteSpan(frameBytes(1, pattern(500))).first(size));
        bare.closeNow();
        const std::string reason = server.next<Closed>().reason;
        EXPECT_EQ(reason.find("in the middle of a message") != std::string::npos, size > 0) << reason;
    }
    client->send(good, 1, 0_epoch, share(pattern(10)));
    EXPECT_EQ(server.next<Received>().payload, pattern(10));
}

TEST(Transport, SilentAndHalfOpenConnectionsHoldNobodyUp) {
    Peer server, client;
    const std::uint16_t port = server.listen();
    std::vector<BareSocket> silent;
    for (int i = 0; i < 20; ++i) {
        silent.emplace_back(port);
        silent.back().say(ByteSpan(frameBytes(1, pattern(500))).first(static_cast<std::size_t>(i)));
    }
    const LinkId link = client->connect({"127.0.0.1", port}, 5s);
    client->send(link, 1, 0_epoch, share(pattern(10)));
    EXPECT_EQ(server.next<Received>().payload, pattern(10));
}

TEST(Transport, AFloodOfSmallFramesStarvesNobody) {
    Peer server, client;
    const std::uint16_t port = server.listen();
    std::promise<void> stop;
    std::thread flood([port, stopped = stop.get_future().share()] {
        BareSocket bare(port);
        Bytes many;
        for (int i = 0; i < 500; ++i) {
            const Bytes frame = frameBytes(2, {});
            many.insert(many.end(), frame.begin(), frame.end());
        }
        for (int i = 0; i < 200 && stopped.wait_for(0s) != std::future_status::ready; ++i) bare.say(many);
    });
    const LinkId link = client->connect({"127.0.0.1", port}, 5s);
    client->send(link, 1, 0_epoch, share(pattern(10)));
    bool heard = false;
    for (int i = 0; i < 200'000 && !heard; ++i) heard = server.next<Received>().type == 1;
    EXPECT_TRUE(heard);
    stop.set_value();
    flood.join();
}

TEST(Transport, ASlowReaderIsClosedAndNotBuffered) {
    TransportLimits limits;
    limits.maxSendQueueBytes = 4 << 20;
    Peer server(std::move(limits));
    BareSocket slow(server.listen());  // never reads
    const LinkId link = server.next<Opened>().link;
    const SharedBytes part = share(pattern(1 << 20));
    for (int i = 0; i < 200; ++i) {
        server->send(link, 1, 0_epoch, part);
        EXPECT_LE(server->queuedBytes(link), std::size_t{5} << 20);
    }
    EXPECT_NE(server.next<Closed>().reason.find("reads too slowly"), std::string::npos);
    EXPECT_EQ(server->queuedBytes(link), 0u);
}

TEST(Transport, APeerWhoseMessagesNobodyTakesIsHeldBack) {
    TransportLimits limits;
    limits.maxUntakenBytes = 1 << 20;
    Peer server(std::move(limits)), client;
    const LinkId link = client->connect({"127.0.0.1", server.listen()}, 5s);
    constexpr int kMessages = 200;
    constexpr std::size_t kBytes = 100'000;
    const SharedBytes part = share(pattern(kBytes));
    for (int i = 0; i < kMessages; ++i) client->send(link, 1, 0_epoch, part);
    const LinkId accepted = server.next<Opened>().link;

    const auto untilHeldBack = [&] {
        int handedOut = 0;
        for (; auto event = server.any(300ms);)
            if (std::holds_alternative<Received>(event->what)) ++handedOut;
        EXPECT_GE(handedOut, 10);
        EXPECT_LE(handedOut, 12);  // the bound, and one message above it
        return handedOut;
    };
    const int handedOut = untilHeldBack();
    EXPECT_GT(client->queuedBytes(link), 0u);

    for (int taken = 0; taken < kMessages; ++taken) {
        if (taken >= handedOut) server.next<Received>();
        server->taken(accepted, kBytes);
    }
    EXPECT_FALSE(server.any(50ms));
    // One that is held back can be closed: what it says is read to its end.
    for (int i = 0; i < 20; ++i) client->send(link, 1, 0_epoch, part);
    untilHeldBack();
    server->close(accepted, "enough");
    EXPECT_EQ(server.next<Closed>().reason, "enough");
}

TEST(Transport, BytesOfAMessageThatIsNotWholeAreHeardOf) {
    TransportLimits limits;
    limits.heardEvery = 0ms;
    Peer server(std::move(limits));
    BareSocket slow(server.listen());
    const LinkId link = server.next<Opened>().link;
    const Bytes frame = frameBytes(1, pattern(1000));
    for (std::size_t at = 0; at < 500; at += 100) {
        slow.say(ByteSpan(frame).subspan(at, 100));
        EXPECT_EQ(server.next<link_event::Heard>().link, link);
    }
    slow.say(ByteSpan(frame).subspan(500));
    EXPECT_EQ(server.next<Received>().payload, pattern(1000));
}

TEST(Transport, ALinkIsKeptAliveByTheNetworkThreadWhereNothingElseIsSaid) {
    Peer server, client;
    const LinkId link = client->connect({"127.0.0.1", server.listen()}, 5s);
    client.next<Opened>();
    client->keepAlive(link, 20ms, 7, 3_epoch, share(ByteChain(share(pattern(5)))));
    for (int i = 0; i < 3; ++i) {
        const Received life = server.next<Received>();
        EXPECT_EQ(life.type, 7);
        EXPECT_EQ(life.epoch, 3_epoch);
        EXPECT_EQ(life.payload, pattern(5));
    }
    client->close(link, "done");
    while (auto event = server.any(5s))
        if (std::holds_alternative<Closed>(event->what)) break;
    EXPECT_EQ(client->queuedBytes(link), 0u);
}

TEST(Transport, ClosingSendsTheLastWords) {
    Peer server;
    BareSocket bare(server.listen());
    const LinkId link = server.next<Opened>().link;
    bare.say(ByteSpan(frameBytes(1, pattern(5000))).first(2000));  // unread bytes on our side must not reset the link
    const SharedBytes last = share(pattern(2 << 20));
    server->send(link, 3, 0_epoch, last);
    server->close(link, "we are done");
    server->send(link, 4, 0_epoch, last);  // too late
    EXPECT_EQ(bare.hear(), frameBytes(3, *last));
    bare.closeNow();
    EXPECT_EQ(server.next<Closed>().reason, "we are done");
}

TEST(Transport, ClosingALinkWhosePeerNeverReadsTakesAboutASecond) {
    Peer server;
    BareSocket bare(server.listen());
    const LinkId link = server.next<Opened>().link;
    server->send(link, 3, 0_epoch, share(pattern(40 << 20)));
    const auto begun = std::chrono::steady_clock::now();
    server->close(link, "enough");
    EXPECT_EQ(server.next<Closed>().reason, "enough");
    EXPECT_LT(std::chrono::steady_clock::now() - begun, 10s);
    EXPECT_EQ(server->queuedBytes(link), 0u);
}

TEST(Transport, ClosedIsTheLastEventAndComesOnce) {
    Peer server;
    const std::uint16_t port = server.listen();
    {
        Peer client;
        for (int i = 0; i < 30; ++i) {
            const LinkId link = client->connect({"127.0.0.1", port}, 5s);
            for (int k = 0; k < 5; ++k) client->send(link, 1, 0_epoch, share(pattern(100'000)));
            if (i % 3 == 0) client->close(link, "early");
        }
        for (int i = 0; i < 10; ++i) client.next<Closed>();
    }  // the others are closed with their transport, their queues sent
    std::set<LinkId> open, closed;
    while (closed.size() < 20 || closed.size() < open.size()) {
        const auto event = server.any(5s);
        if (!event) break;
        if (const auto* opened = std::get_if<Opened>(&event->what)) {
            EXPECT_TRUE(open.insert(opened->link).second);
        } else if (const auto* received = std::get_if<Received>(&event->what)) {
            EXPECT_TRUE(open.contains(received->link) && !closed.contains(received->link));
        } else if (const auto* end = std::get_if<Closed>(&event->what)) {
            EXPECT_TRUE(closed.insert(end->link).second);
        } else {
            EXPECT_FALSE(closed.contains(linkOf(*event)));
        }
    }
    EXPECT_EQ(open, closed);
    EXPECT_GE(closed.size(), 20u);
}

TEST(Transport, LinksAboveTheLimitAreClosedAndTheOthersStay) {
    TransportLimits limits;
    limits.maxLinks = 3;
    Peer server(std::move(limits));
    const std::uint16_t port = server.listen();
    std::vector<BareSocket> sockets;
    for (int i = 0; i < 3; ++i) {
        sockets.emplace_back(port).say(frameBytes(1, pattern(3)));
        server.next<Received>();
    }
    BareSocket extra(port);
    EXPECT_TRUE(extra.hear().empty()) << "closed at once";
    server->connect({"127.0.0.1", port}, 5s);
    EXPECT_WORDS(server.next<Closed>().reason);

    sockets.pop_back();
    server.next<Closed>();
    BareSocket again(port);
    server.next<Opened>();
    sockets.front().say(frameBytes(1, pattern(3)));
    EXPECT_EQ(server.next<Received>().payload, pattern(3));
}

/// They are as many as there may be, again and again; a peer that needs a moment to speak has it each time.
TEST(Transport, OfManyThatSayNothingTheOldestGivesWayOnceItHasHadItsTime) {
    TransportLimits limits;
    limits.maxStrangers = 4;
    limits.patience = 2s;
    limits.lastWord = {.type = 7, .payload = share(ByteChain(ByteSlice(pattern(5))))};
    Peer server(std::move(limits));
    const std::uint16_t port = server.listen();
    std::vector<BareSocket> silent;
    for (int i = 0; i < 3; ++i) silent.emplace_back(port);
    BareSocket slow(port);
    for (int i = 0; i < 4; ++i) silent.emplace_back(port);
    // A part of its time is over, and nobody has had to go.
    for (; auto event = server.any(150ms);) EXPECT_FALSE(std::holds_alternative<Closed>(event->what));
    slow.say(frameBytes(1, pattern(3)));
    EXPECT_EQ(server.next<Received>().payload, pattern(3));
    Bytes word = frameBytes(7, pattern(5));
    for (int i = 0; i < 3; ++i) EXPECT_EQ(silent[i].hear(), word) << "told so, and closed";
    // A header that never becomes whole is no message.
    silent[3].say(ByteSpan(frameBytes(1, pattern(3))).first(7));
    silent.emplace_back(port);
    EXPECT_TRUE(silent[3].hear().size() == word.size());
    slow.say(frameBytes(2, pattern(9)));
    EXPECT_EQ(server.next<Received>().payload, pattern(9));
}

/// They have had their answer, and hold on to what they were refused.
TEST(Transport, WhoWasRefusedAndStaysGivesWay) {
    TransportLimits limits;
    limits.maxLinks = 3;
    limits.patience = 50ms;
    Peer server(std::move(limits));
    const std::uint16_t port = server.listen();
    std::vector<BareSocket> refused;
    for (int i = 0; i < 20; ++i) {
        refused.emplace_back(port).say(frameBytes(1, pattern(3)));
        server->close(server.next<Received>().link, "refused");
        refused.back().say(frameBytes(1, pattern(3)));  // what it goes on saying does not help it
    }
    BareSocket good(port);
    good.say(frameBytes(2, pattern(9)));
    EXPECT_EQ(server.next<Received>().payload, pattern(9));
}

TEST(Transport, RunningOutOfDescriptorsStopsNothing) {
    if (kSanitized)
        GTEST_SKIP() << "to look at a type the sanitizer opens a pipe, and takes it for a fault that it cannot";
    Peer server, client;
    const std::uint16_t port = server.listen();
    const LinkId link = client->connect({"127.0.0.1", port}, 5s);
    client->send(link, 1, 0_epoch, share(pattern(10)));
    EXPECT_EQ(server.next<Received>().payload, pattern(10));
    rlimit before{};
    ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &before), 0);
    // One descriptor for the client's end, none for the server's.
    const auto noneLeft = [&] {
        const int highest = ::dup(0);
        ::close(highest);
        const rlimit tight{static_cast<rlim_t>(highest) + 1, before.rlim_max};
        ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &tight), 0);
    };
    noneLeft();
    const auto cpuBefore = std::clock();
    BareSocket starved(port);
    for (; auto event = server.any(300ms);) EXPECT_FALSE(std::holds_alternative<Opened>(event->what));
    const double cpuSeconds = static_cast<double>(std::clock() - cpuBefore) / CLOCKS_PER_SEC;
    client->send(link, 1, 0_epoch, share(pattern(10)));
    EXPECT_EQ(server.next<Received>().payload, pattern(10));
    ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &before), 0);
    EXPECT_LT(cpuSeconds, 0.15) << "accepting again and again burns the processor";
    starved.say(frameBytes(2, {}));
    EXPECT_EQ(server.next<Received>().type, 2) << "the connection waited in the backlog";

    BareSocket silent(port);
    server.next<Opened>();
    noneLeft();
    BareSocket next(port);
    next.say(frameBytes(3, {}));
    EXPECT_EQ(server.next<Received>().type, 3) << "one that says nothing gives its descriptor away";
    EXPECT_TRUE(silent.hear().empty());
    ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &before), 0);
}

TEST(Transport, ManyLinksAtOnce) {
    Peer server, client;
    const std::uint16_t port = server.listen();
    constexpr int kLinks = 200;
    std::vector<LinkId> links;
    for (int i = 0; i < kLinks; ++i) links.push_back(client->connect({"127.0.0.1", port}, 10s));
    for (const LinkId link : links) client->send(link, 1, 0_epoch, share(pattern(1000)));
    for (int i = 0; i < kLinks; ++i) {
        const Received frame = server.next<Received>();
        ASSERT_FALSE(frame.payload.empty());
        server->send(frame.link, 2, 0_epoch, frame.payload);
    }
    std::set<LinkId> answered;
    for (int i = 0; i < kLinks; ++i) answered.insert(client.next<Received>().link);
    EXPECT_EQ(answered.size(), static_cast<std::size_t>(kLinks));
}

TEST(Transport, UnknownLinksAreIgnored) {
    Peer peer;
    peer->send(LinkId{12345}, 1, 0_epoch, share(pattern(10)));
    peer->send(LinkId{}, 1, 0_epoch, ByteSlice());
    peer->close(LinkId{12345}, "nobody");
    EXPECT_EQ(peer->queuedBytes(LinkId{12345}), 0u);
    EXPECT_FALSE(peer.any(50ms));
}

TEST(Transport, EventsCarryTheTimeOfArrival) {
    Peer server, client;
    const LinkId link = client->connect({"127.0.0.1", server.listen()}, 5s);
    const TimePoint before = std::chrono::steady_clock::now();
    client->send(link, 1, 0_epoch, share(pattern(10)));
    for (;;) {
        const auto event = server.any(5s);
        ASSERT_TRUE(event);
        if (!std::holds_alternative<Received>(event->what)) continue;
        EXPECT_GE(event->at, before);
        EXPECT_LE(event->at, TimePoint(std::chrono::steady_clock::now()));
        break;
    }
}

}  // namespace
}  // namespace tessera
