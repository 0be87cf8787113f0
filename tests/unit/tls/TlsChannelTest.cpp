#include "common/tls/TlsChannel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "WallOfKeys.h"
#include "common/tls/OpenSsl.h"
#include "tests/support/words/Words.h"
#include "tests/unit/Eventually.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;
using test::contextOf;
using test::eventually;
using test::WallOfKeys;
using Side = TlsChannel::Side;
using Context = std::shared_ptr<const TlsContext>;

const WallOfKeys& wall() {
    static const WallOfKeys keys;
    return keys;
}
const WallOfKeys& otherWall() {
    static const WallOfKeys keys("dome");
    return keys;
}

/// Two ends of one wire, without a socket.
struct Wire {
    Wire(const Context& dialling, const Context& accepting)
        : client(dialling, Side::kDials, "here"), server(accepting, Side::kAccepts) {}

    /// Until nobody has anything more to say; `step` bytes arrive at a time.
    void shake(std::size_t step = 100'000) {
        clientSays = client.shake();
        for (bool more = true; more;) {
            more = carry(client, server, serverSays, step);
            more = carry(server, client, clientSays, step) || more;
        }
    }
    /// What is sealed on one side comes out on the other.
    static Bytes across(TlsChannel& from, TlsChannel& to, ByteSpan bytes, std::size_t step, std::size_t room) {
        EXPECT_TRUE(from.seal(bytes));
        Bytes sealed;
        sealed.swap(from.outgoing());
        Bytes all, part(room);
        for (std::size_t at = 0; at < sealed.size(); at += step) {
            to.arrived(ByteSpan(sealed).subspan(at, std::min(step, sealed.size() - at)));
            for (;;) {
                const Expected<std::size_t> count = to.read(part);
                EXPECT_TRUE(count) << count.error().message;
                if (!count || *count == 0) break;
                all.insert(all.end(), part.begin(), part.begin() + static_cast<std::ptrdiff_t>(*count));
            }
        }
        return all;
    }
    [[nodiscard]] std::string faults() const {
        return (clientSays ? std::string() : clientSays.error().message) + " | " +
               (serverSays ? std::string() : serverSays.error().message);
    }
    [[nodiscard]] bool open() const { return client.ready() && server.ready(); }

    TlsChannel client, server;
    Expected<void> clientSays, serverSays;

private:
    static bool carry(TlsChannel& from, TlsChannel& to, Expected<void>& said, std::size_t step) {
        Bytes bytes;
        bytes.swap(from.outgoing());
        for (std::size_t at = 0; at < bytes.size(); at += step) {
            const Bytes part(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                             bytes.begin() + static_cast<std::ptrdiff_t>(std::min(at + step, bytes.size())));
            to.arrived(part);
            if (to.ready()) {
                Bytes none(64);
                EXPECT_TRUE(to.read(none));  // tickets
            } else if (said) {
                said = to.shake();
            }
            to.keep();
        }
        return !bytes.empty();
    }
};

Bytes noise(std::size_t size, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    Bytes bytes(size);
    for (std::byte& byte : bytes) byte = static_cast<std::byte>(random());
    return bytes;
}

Context serverContext() {
    static const Context context = contextOf(wall().keysOf(wall().server()));
    return context;
}
Context hostContext() {
    static const Context context = contextOf(wall().keysOf(wall().host("left")));
    return context;
}

TEST(TlsChannel, BothSidesKnowWhomTheySpeakTo) {
    for (const std::size_t step : {1u, 7u, 100u, 100'000u}) {
        Wire wire(contextOf(wall().keysOf(wall().host("left"))), serverContext());
        wire.shake(step);
        ASSERT_TRUE(wire.open()) << wire.faults();
        ASSERT_TRUE(wire.server.peer() && wire.client.peer());
        EXPECT_EQ(wire.server.peer()->identity, wall().host("left"));
        EXPECT_EQ(wire.server.peer()->fault, "");
        EXPECT_EQ(wire.client.peer()->identity, wall().server());
    }
}

TEST(TlsChannel, WhatIsSealedComesOutWhole) {
    Wire wire(hostContext(), serverContext());
    wire.shake();
    ASSERT_TRUE(wire.open());
    for (const std::size_t size : {1u, 16'384u, 16'385u, 1'000'000u})
        for (const std::size_t step : {3u, 1000u, 1'000'000u}) {
            if (size / step > 10'000) continue;
            const Bytes bytes = noise(size, size + step);
            EXPECT_EQ(Wire::across(wire.client, wire.server, bytes, step, 5000), bytes);
            EXPECT_EQ(Wire::across(wire.server, wire.client, bytes, step, 100'000), bytes);
        }
    EXPECT_FALSE(wire.server.peerEnded());
    wire.client.end();
    EXPECT_EQ(Wire::across(wire.client, wire.server, {}, 100, 100), Bytes());
    EXPECT_TRUE(wire.server.peerEnded());
}

TEST(TlsChannel, WhoHasNoKeyIsNobodyYet) {
    TlsKeys none = wall().keysWith({});
    Wire wire(contextOf(none), serverContext());
    wire.shake();
    ASSERT_TRUE(wire.open());
    EXPECT_FALSE(wire.server.peer());
}

TEST(TlsChannel, AFingerprintIsEnoughToKnowTheServer) {
    Wire wire(contextOf(wall().pinned()), serverContext());
    wire.shake();
    EXPECT_TRUE(wire.open()) << wire.faults();

    Wire other(contextOf(otherWall().pinned()), serverContext());
    other.shake();
    ASSERT_FALSE(other.clientSays);
    EXPECT_EQ(other.clientSays.error().code, ErrorCode::kRefused);
    EXPECT_WORDS(other.clientSays.error().message);
    EXPECT_FALSE(other.client.ready());
}

/// A self-signed certificate with the same words in it is not the authority.
TEST(TlsChannel, AnAuthorityOfTheSameNameIsAnother) {
    const WallOfKeys twin("cave");
    for (const TlsKeys& keys : {wall().keysOf(wall().host("left")), wall().pinned()}) {
        Wire wire(contextOf(keys), contextOf(twin.keysOf(twin.server())));
        wire.shake();
        ASSERT_FALSE(wire.clientSays);
        EXPECT_EQ(wire.clientSays.error().code, ErrorCode::kRefused);
    }
    // And to the server, who is let finish the handshake to be told.
    Wire wire(contextOf(wall().pinned(twin.issue(twin.host("left")).pem)), serverContext());
    wire.shake();
    ASSERT_TRUE(wire.open());
    ASSERT_TRUE(wire.server.peer());
    EXPECT_NE(wire.server.peer()->fault, "");
}

TEST(TlsChannel, WhoeverIsRefusedIsNotResumed) {
    const WallOfKeys twin("cave");
    const Context stranger = contextOf(wall().pinned(twin.issue(twin.host("left")).pem));
    const Context accepting = contextOf(wall().keysOf(wall().server()));
    for (int round = 0; round < 3; ++round) {
        Wire wire(stranger, accepting);
        wire.shake();
        ASSERT_TRUE(wire.open());
        EXPECT_FALSE(wire.client.resumed());
        ASSERT_TRUE(wire.server.peer());
        EXPECT_WORDS(wire.server.peer()->fault);
    }
}

/// A key of this wall, for another purpose.
TEST(TlsChannel, AKeyInTheWrongPlaceIsNotAnotherAuthoritys) {
    const Context server = contextOf(wall().keysOf(wall().server())),
                  host = contextOf(wall().keysOf(wall().host("left")));
    Wire dialling(server, server);
    dialling.shake();
    ASSERT_TRUE(dialling.server.peer());
    const std::string fault = dialling.server.peer()->fault;
    EXPECT_WORDS(fault);
    EXPECT_EQ(fault.find("another authority"), std::string::npos) << fault;
    Wire accepting(contextOf(wall().pinned()), host);
    accepting.shake();
    ASSERT_FALSE(accepting.clientSays);
    EXPECT_EQ(accepting.clientSays.error().message.find("another authority"), std::string::npos)
        << accepting.clientSays.error().message;
}

/// Both clocks are told of, on both sides.
TEST(TlsChannel, ExpiryIsToldWithBothClocks) {
    const std::string today = toText(std::chrono::system_clock::now()).substr(0, 10);
    const auto twice = [&](const std::string& text) {
        const std::size_t first = text.find(today);
        return first != std::string::npos && text.find(today, first + 1) != std::string::npos;
    };
    const auto ended = [](const Identity& holder) { return wall().issue(holder, 48h, 24h).pem; };
    const auto early = [](const Identity& holder) { return wall().issue(holder, -48h).pem; };
    for (const auto& make : {std::function(ended), std::function(early)}) {
        Wire client(hostContext(), contextOf(wall().keysWith(make(wall().server()))));
        client.shake();
        ASSERT_FALSE(client.clientSays);
        EXPECT_EQ(client.clientSays.error().code, ErrorCode::kRefused);
        EXPECT_TRUE(twice(client.clientSays.error().message)) << client.clientSays.error().message;

        Wire server(contextOf(wall().keysWith(make(wall().host("left")))), serverContext());
        server.shake();
        ASSERT_TRUE(server.open() && server.server.peer());
        EXPECT_TRUE(twice(server.server.peer()->fault)) << server.server.peer()->fault;
    }
}

TEST(TlsChannel, RevokedSerialsLetNobodyIn) {
    const Authority::Issued key = wall().issue(wall().person("anna", Role::kEditor));
    TlsKeys keys = wall().keysOf(wall().server());
    const Context before = contextOf(keys);
    keys.revoked.insert(key.certificate.serial);
    const Context after = contextOf(keys);
    const Context anna = contextOf(wall().keysWith(key.pem));
    Wire good(anna, before);
    good.shake();
    ASSERT_TRUE(good.open());
    EXPECT_EQ(good.server.peer()->fault, "");
    EXPECT_EQ(good.server.peer()->identity.role, Role::kEditor);
    EXPECT_NE(good.server.faultNow(*after), "");  // while it is open
    // And with the ticket from before.
    Wire refused(anna, after);
    refused.shake();
    ASSERT_TRUE(refused.open() && refused.server.peer());
    EXPECT_FALSE(refused.server.resumed());
    EXPECT_WORDS(refused.server.peer()->fault);
}

TEST(TlsChannel, ASessionIsResumedAndItsHolderLookedAtAgain) {
    const Context accepting = contextOf(wall().keysOf(wall().server()));
    const Context dialling = contextOf(wall().keysWith(wall().issue(wall().host("left"), 0s, 2s).pem));
    Wire first(dialling, accepting);
    first.shake();
    ASSERT_TRUE(first.open());
    EXPECT_FALSE(first.server.resumed());
    Wire second(dialling, accepting);
    second.shake();
    ASSERT_TRUE(second.open());
    EXPECT_TRUE(second.server.resumed() && second.client.resumed());
    ASSERT_TRUE(second.server.peer());
    EXPECT_EQ(second.server.peer()->identity, wall().host("left"));
    EXPECT_EQ(second.server.peer()->fault, "");
    ASSERT_TRUE(eventually([&] { return !second.server.faultNow(*accepting).empty(); })) << "it ends after two seconds";
    Wire third(dialling, accepting);
    third.shake();
    ASSERT_TRUE(third.open() && third.server.peer());
    EXPECT_NE(third.server.peer()->fault.find("held until"), std::string::npos) << third.server.peer()->fault;
}

TEST(TlsChannel, AServersKeyIsNoHostsNorTheOtherWayRound) {
    Wire asHost(serverContext(), serverContext());
    asHost.shake();
    ASSERT_TRUE(!asHost.serverSays || !asHost.server.peer() || !asHost.server.peer()->fault.empty());
    EXPECT_FALSE(hostContext()->mayAccept());
    Wire asServer(hostContext(), contextOf(wall().keysOf(wall().host("right"))));
    asServer.shake();
    EXPECT_FALSE(asServer.clientSays);
    EXPECT_FALSE(asServer.client.ready());
}

TEST(TlsChannel, WhatIsNoTlsIsRefusedInWords) {
    TlsChannel client(hostContext(), Side::kDials, "here");
    ASSERT_TRUE(client.shake());
    const Bytes plain = noise(100, 1);
    client.arrived(asBytes("TSRA, and more that is plain"));
    const Expected<void> said = client.shake();
    ASSERT_FALSE(said);
    EXPECT_EQ(said.error().code, ErrorCode::kNetwork);
    EXPECT_WORDS(said.error().message);
}

/// A record's head says a version, which nobody is to look at (RFC 8446, 5.1).
bool isVersion(ByteSpan records, std::size_t at) {
    constexpr std::size_t kHead = 5;
    for (std::size_t record = 0; record + kHead <= records.size();) {
        if (at == record + 1 || at == record + 2) return true;
        record += kHead + (std::to_integer<std::size_t>(records[record + 3]) << 8) +
                  std::to_integer<std::size_t>(records[record + 4]);
    }
    return false;
}

/// Whatever else is changed on the wire: a handshake never ends well on both sides, and bytes never come out otherwise
/// than they went in.
TEST(TlsChannel, NothingThatIsChangedOnTheWireIsBelieved) {
    constexpr int kSeeds = 400;
    for (int seed = 0; seed < kSeeds; ++seed) {
        SCOPED_TRACE(seed);
        std::mt19937_64 random(static_cast<std::uint64_t>(seed));
        TlsChannel client(hostContext(), Side::kDials, "fuzz"), server(serverContext(), Side::kAccepts);
        const auto change = [&](Bytes bytes) {
            std::size_t at = random() % bytes.size();
            while (isVersion(bytes, at)) at = random() % bytes.size();
            bytes[at] ^= static_cast<std::byte>(1 + random() % 255);
            return bytes;
        };
        const unsigned victim = static_cast<unsigned>(random() % 3);  // which flight
        ASSERT_TRUE(client.shake());
        Bytes hello = std::exchange(client.outgoing(), {});
        if (victim == 0) hello = change(hello);
        server.arrived(hello);
        const Expected<void> answered = server.shake();
        server.keep();
        Bytes answer = std::exchange(server.outgoing(), {});
        if (answer.empty()) continue;
        if (victim == 1) answer = change(answer);
        client.arrived(answer);
        const Expected<void> finished = client.shake();
        client.keep();
        Bytes finish = std::exchange(client.outgoing(), {});
        if (finish.empty()) continue;
        if (victim == 2) finish = change(finish);
        server.arrived(finish);
        const Expected<void> last = server.shake();
        EXPECT_FALSE(answered && finished && last && client.ready() && server.ready());
    }
    Wire wire(hostContext(), serverContext());
    wire.shake();
    ASSERT_TRUE(wire.open());
    const Bytes bytes = noise(2000, 5);
    ASSERT_TRUE(wire.client.seal(bytes));
    Bytes sealed = std::exchange(wire.client.outgoing(), {});
    sealed[1000] ^= std::byte{1};
    wire.server.arrived(sealed);
    Bytes room(4000);
    EXPECT_FALSE(wire.server.read(room));
}

/// A peer that OpenSSL plays by itself, and that may change its keys.
class BarePeer {
public:
    explicit BarePeer(TlsChannel& server) : server_(server), context_(SSL_CTX_new(TLS_client_method())) {
        ssl_.reset(SSL_new(context_.get()));
        in_ = BIO_new(BIO_s_mem());
        out_ = BIO_new(BIO_s_mem());
        SSL_set_bio(ssl_.get(), in_, out_);
        SSL_set_connect_state(ssl_.get());
        while (!server_.ready()) {
            SSL_do_handshake(ssl_.get());
            const Bytes wire = says();
            server_.arrived(wire);
            if (wire.empty() || !server_.shake()) return;
            server_.keep();
            hears();
        }
    }
    void changeKeys() {
        ASSERT_EQ(SSL_key_update(ssl_.get(), SSL_KEY_UPDATE_REQUESTED), 1);
        ASSERT_EQ(SSL_do_handshake(ssl_.get()), 1);
    }
    void seal(ByteSpan bytes) {
        ASSERT_EQ(SSL_write(ssl_.get(), bytes.data(), static_cast<int>(bytes.size())), static_cast<int>(bytes.size()));
    }
    /// What it has sealed arrives: how many bytes of content, or what is wrong.
    Expected<std::size_t> arrives() {
        const Bytes wire = says();
        server_.arrived(wire);
        std::size_t all = 0;
        Bytes room(64'000);
        for (;;) {
            const Expected<std::size_t> count = server_.read(room);
            if (!count) return count;
            if (*count == 0) break;
            all += *count;
        }
        server_.keep();
        hears();
        return all;
    }

private:
    Bytes says() {
        Bytes bytes(BIO_ctrl_pending(out_));
        if (!bytes.empty()) BIO_read(out_, bytes.data(), static_cast<int>(bytes.size()));
        return bytes;
    }
    void hears() {
        Bytes& bytes = server_.outgoing();
        if (!bytes.empty()) BIO_write(in_, bytes.data(), static_cast<int>(bytes.size()));
        bytes.clear();
        char byte = 0;
        if (SSL_is_init_finished(ssl_.get())) SSL_read(ssl_.get(), &byte, 1);  // tickets, answers
    }

    TlsChannel& server_;
    SslContextPtr context_;
    SslPtr ssl_;
    BIO *in_ = nullptr, *out_ = nullptr;  // the SSL's
};

TEST(TlsChannel, KeysAreChangedAsOftenAsContentAsksForIt) {
    TlsChannel server(serverContext(), Side::kAccepts);
    BarePeer peer(server);
    ASSERT_TRUE(server.ready());
    const Bytes content = noise(std::size_t{1} << 20, 9);
    for (int i = 0; i < 100; ++i) {
        peer.changeKeys();
        peer.seal(content);
        const Expected<std::size_t> came = peer.arrives();
        ASSERT_TRUE(came) << i << " " << came.error().message;
        ASSERT_EQ(*came, content.size());
    }
}

TEST(TlsChannel, WhoChangesKeysAgainAndAgainIsNotListenedTo) {
    for (const bool betweenBytes : {false, true}) {
        TlsChannel server(serverContext(), Side::kAccepts);
        BarePeer peer(server);
        ASSERT_TRUE(server.ready());
        for (int i = 0; i < 5'000; ++i) {
            peer.changeKeys();
            if (betweenBytes) peer.seal(noise(1, 2));
        }
        const Expected<std::size_t> came = peer.arrives();
        ASSERT_FALSE(came);
        EXPECT_EQ(came.error().code, ErrorCode::kNetwork);
        EXPECT_WORDS(came.error().message);
        EXPECT_LT(server.outgoing().size(), 10'000u) << "answers to a few dozens";
    }
}

TEST(TlsContext, RefusesKeysThatDoNotBelongTogether) {
    const auto fault = [](const TlsKeys& keys) {
        const auto made = TlsContext::make(keys);
        return made ? std::string() : made.error().message;
    };
    TlsKeys keys = wall().keysOf(wall().server());
    EXPECT_EQ(fault(keys), "");
    keys.own = otherWall().issue(otherWall().server()).pem;
    EXPECT_WORDS(fault(keys));
    keys.own = "rubbish";
    EXPECT_WORDS(fault(keys));
    keys = wall().keysOf(wall().server());
    keys.authority = "rubbish";
    EXPECT_NE(fault(keys), "");
    EXPECT_NE(fault(TlsKeys{}), "");
    TlsKeys pinned;
    pinned.pinned = std::string(63, 'a');
    EXPECT_NE(fault(pinned), "");
    // The key of one with the certificate of the other.
    const std::string a = wall().issue(wall().host("a")).pem, b = wall().issue(wall().host("b")).pem;
    keys = wall().keysWith(a.substr(0, a.find("-----BEGIN CERT")) + b.substr(b.find("-----BEGIN CERT")));
    EXPECT_WORDS(fault(keys));
}

}  // namespace
}  // namespace tessera
