/// A door with keys: what it speaks, whom it lets in, and whom no more.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <atomic>
#include <random>
#include <vector>

#include "SealedPeer.h"
#include "server/door/Door.h"
#include "tests/support/words/Words.h"
#include "tests/unit/Eventually.h"
#include "tests/unit/tls/WallOfKeys.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;
using test::contextOf;
using test::SealedPeer;
using test::WallOfKeys;
using KeysNow = std::shared_ptr<const TlsContext>;

const WallOfKeys& cave() {
    static const WallOfKeys keys;
    return keys;
}
const AccessTokens kWords{{"looks-and-no-more", "changes-the-scene", "does-all-there-is"}};

class SealedDoor : public testing::Test {
protected:
    SealedDoor() {
        const Authority::Issued own =
            *cave().authority().issue(cave().server(), {"localhost", "127.0.0.1"}, std::chrono::system_clock::now());
        keys = cave().keysWith(own.pem);
        current.store(contextOf(keys));
        openDoor();
        host = fmt::format("Host: 127.0.0.1:{}\r\n", door->address().port);
    }

    void openDoor() {
        auto opened = Door::open({.listen = {"127.0.0.1", 0},
                                  .server = {"127.0.0.1", backlog.port},
                                  .wall = "cave",
                                  .tokens = kWords,
                                  .reach = {.keys = [this] { return current.load(); }}});
        EXPECT_TRUE(opened) << opened.error().message;
        if (opened) door = std::move(*opened);
    }

    void revoke(const Authority::Issued& key) {
        keys.revoked.insert(key.certificate.serial);
        current.store(contextOf(keys));
    }
    /// Who has the link alone.
    [[nodiscard]] SealedPeer withLink() const { return {door->address().port, contextOf(cave().pinned())}; }
    [[nodiscard]] SealedPeer with(const std::string& pem) const {
        return {door->address().port, contextOf(cave().pinned(pem))};
    }
    [[nodiscard]] std::string get(const std::string& path, const std::string& token = {}) const {
        const std::string bearer = token.empty() ? "" : fmt::format("Authorization: Bearer {}\r\n", token);
        return fmt::format("GET {} HTTP/1.1\r\n{}{}\r\n", path, host, bearer);
    }
    /// The text below an answer's head.
    static std::string bodyOf(const std::string& answer) { return answer.substr(answer.find("\r\n\r\n") + 4); }
    [[nodiscard]] std::string openSocket() const {
        return fmt::format(
            "GET /socket HTTP/1.1\r\n{}Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
            "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n",
            host);
    }

    /// A server that takes connections and says nothing.
    struct Backlog {
        Backlog() : socket(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
            sockaddr_in at{};
            at.sin_family = AF_INET;
            at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
            socklen_t size = sizeof at;
            EXPECT_EQ(::bind(socket, reinterpret_cast<const sockaddr*>(&at), size), 0);
            EXPECT_EQ(::listen(socket, 64), 0);
            EXPECT_EQ(::getsockname(socket, reinterpret_cast<sockaddr*>(&at), &size), 0);
            port = ntohs(at.sin_port);
        }
        ~Backlog() { ::close(socket); }
        int socket = -1;
        std::uint16_t port = 0;
    } backlog;
    std::vector<std::unique_ptr<SealedPeer>> sockets;
    TlsKeys keys;
    std::atomic<KeysNow> current;
    std::unique_ptr<Door> door;
    std::string host;
};

TEST_F(SealedDoor, HasALinkThatNamesTheAuthority) {
    EXPECT_EQ(door->linkWith(kWords.of(Role::kOperator)),
              fmt::format("https://127.0.0.1:{}/?token={}&authority={}", door->address().port,
                          kWords.of(Role::kOperator), cave().authority().certificate().fingerprint));
}

TEST_F(SealedDoor, LetsInByTokenWhoHasNoKey) {
    SealedPeer peer = withLink();
    ASSERT_TRUE(peer.ready()) << peer.fault();
    peer.say(get("/api", kWords.of(Role::kViewer)));
    EXPECT_TRUE(peer.hear("GetStatus").starts_with("HTTP/1.1 200 "));
    SealedPeer without = withLink();
    without.say(get("/api"));
    EXPECT_TRUE(without.hear("\r\n\r\n").starts_with("HTTP/1.1 401 "));
}

TEST_F(SealedDoor, TellsTheAuthorityToAnybody) {
    SealedPeer peer = withLink();
    peer.say(get("/authority.crt"));
    const std::string answer = peer.hear("-----END CERTIFICATE-----");
    const std::size_t pem = answer.find("-----BEGIN CERTIFICATE-----");
    ASSERT_NE(pem, std::string::npos) << answer;
    EXPECT_EQ(Certificate::read(answer.substr(pem))->fingerprint, cave().authority().certificate().fingerprint);
    EXPECT_EQ(answer.find("PRIVATE"), std::string::npos);
}

TEST_F(SealedDoor, LetsInByKeyInItsHoldersRole) {
    const std::string pem = cave().issue(cave().person("anna", Role::kViewer)).pem;
    SealedPeer reader = with(pem), viewer = with(pem);
    ASSERT_TRUE(reader.ready()) << reader.fault();
    reader.say(get("/api"));
    EXPECT_TRUE(reader.hear("GetStatus").starts_with("HTTP/1.1 200 "));
    ASSERT_TRUE(viewer.ready()) << viewer.fault();
    // A token that could do more counts for nothing beside a key.
    viewer.say(
        fmt::format("POST /api/RemoveNode HTTP/1.1\r\n{}Authorization: Bearer {}\r\nContent-Length: 2\r\n\r\n{{}}",
                    host, kWords.of(Role::kOperator)));
    const std::string refused = viewer.hear("}}\n");
    EXPECT_TRUE(refused.starts_with("HTTP/1.1 403 ")) << refused;
    EXPECT_WORDS(bodyOf(refused));
}

TEST_F(SealedDoor, RefusesKeysThatLetNobodyInAndSaysWhy) {
    const Authority::Issued gone = cave().issue(cave().person("bob", Role::kOperator));
    revoke(gone);
    const WallOfKeys other("cave");
    const std::string old = cave().issue(cave().person("old", Role::kOperator), 48h, 1h).pem;
    for (const std::string& pem : {cave().issue(cave().host("left")).pem, old, gone.pem,
                                   other.issue(other.person("eve", Role::kOperator)).pem}) {
        SealedPeer peer = with(pem);
        ASSERT_TRUE(peer.ready()) << peer.fault();
        peer.say(get("/api", kWords.of(Role::kOperator)));
        const std::string answer = peer.hear("}}\n");
        EXPECT_TRUE(answer.starts_with("HTTP/1.1 403 ")) << answer;
        if (pem == old)
            EXPECT_NE(answer.find("held until"), std::string::npos) << answer;  // and moments
        else
            EXPECT_WORDS(bodyOf(answer));
        EXPECT_TRUE(peer.closes());
    }
}

TEST_F(SealedDoor, SendsAwayAtOnceWhoseKeyIsRevoked) {
    const Authority::Issued bob = cave().issue(cave().person("bob", Role::kOperator));
    SealedPeer kept = with(bob.pem), socket = with(bob.pem);
    SealedPeer other = with(cave().issue(cave().person("anna", Role::kViewer)).pem), linked = withLink();
    for (SealedPeer* each : {&kept, &other}) each->say(get("/style.css"));
    linked.say(get("/api", kWords.of(Role::kViewer)));
    for (SealedPeer* each : {&kept, &other, &linked})
        ASSERT_NE(each->hear("\r\n\r\n").find(" 200 "), std::string::npos);
    socket.say(openSocket());
    ASSERT_NE(socket.hear("\r\n\r\n").find(" 101 "), std::string::npos) << socket.heard();

    revoke(bob);
    EXPECT_TRUE(kept.closes()) << "long before it has rested for its time";
    EXPECT_TRUE(socket.closes());
    EXPECT_NE(socket.heard().find("has been revoked"), std::string::npos) << "in words";
    other.forget();
    linked.forget();
    other.say(get("/api"));
    linked.say(get("/api", kWords.of(Role::kViewer)));
    for (SealedPeer* each : {&other, &linked}) EXPECT_NE(each->hear("GetStatus").find(" 200 "), std::string::npos);
    SealedPeer again = with(bob.pem);
    again.say(get("/api"));
    EXPECT_WORDS(bodyOf(again.hear("}}\n")));
}

/// At the look that ends the others.
TEST_F(SealedDoor, TellsWhyToWhomItRevokesBeforeTheyHaveAsked) {
    const Authority::Issued bob = cave().issue(cave().person("bob", Role::kOperator));
    SealedPeer late = with(bob.pem), kept = with(bob.pem);
    kept.say(get("/style.css"));
    ASSERT_NE(kept.hear("\r\n\r\n").find(" 200 "), std::string::npos);
    ASSERT_TRUE(late.ready()) << late.fault();
    revoke(bob);
    EXPECT_TRUE(kept.closes());
    late.say(get("/api"));
    const std::string answer = late.hear("}}\n");
    ASSERT_TRUE(answer.starts_with("HTTP/1.1 403 ")) << answer;
    EXPECT_WORDS(bodyOf(answer));
    EXPECT_TRUE(late.closes());
}

/// While no file changes: its time is over.
TEST_F(SealedDoor, SendsAwayWhoseTokenEnds) {
    const std::string word = freshToken();
    keys.tokens.push_back(
        {.hash = hashOfToken(word), .pass = {"ci", Role::kViewer}, .until = std::chrono::system_clock::now() + 2s});
    current.store(contextOf(keys));
    SealedPeer asks = withLink(), rests = withLink(), socket = withLink();
    for (SealedPeer* each : {&asks, &rests}) {
        each->say(get("/api", word));
        EXPECT_NE(each->hear("GetStatus").find(" 200 "), std::string::npos);
    }
    // What anybody may ask keeps nobody's place.
    asks.say(get("/authority.crt"));
    EXPECT_NE(asks.hear("-----END CERTIFICATE-----").find("-----END"), std::string::npos);
    std::string upgrade = openSocket();
    upgrade.insert(upgrade.find("Upgrade:"), fmt::format("Authorization: Bearer {}\r\n", word));
    socket.say(upgrade);
    ASSERT_NE(socket.hear("\r\n\r\n").find(" 101 "), std::string::npos) << socket.heard();
    EXPECT_TRUE(socket.closes());
    EXPECT_NE(socket.heard().find("its token has ended"), std::string::npos) << socket.heard();
    for (SealedPeer* each : {&asks, &rests}) EXPECT_TRUE(each->closes()) << "a connection that is kept goes, too";
    SealedPeer again = withLink();
    again.say(get("/api", word));
    EXPECT_TRUE(again.hear("}}\n").starts_with("HTTP/1.1 401 ")) << again.heard();
}

/// With keys and without: who came in by a token of the server's own.
TEST_F(SealedDoor, SendsAwayWhoseTokenIsRenewed) {
    const AccessTokens anew{{"looks-once-again", "changes-again", "does-all-again"}};
    const auto plain = Door::open({.listen = {"127.0.0.1", 0},
                                   .server = {"127.0.0.1", backlog.port},
                                   .wall = "cave",
                                   .tokens = kWords,
                                   .panels = {{"visits-the-panel", "0123", "Hall"}}});
    ASSERT_TRUE(plain) << plain.error().message;
    const std::string plainHost = fmt::format("Host: 127.0.0.1:{}\r\n", (*plain)->address().port);
    const auto upgrade = [&](const std::string& token) {
        std::string said = openSocket();
        said.insert(said.find("Upgrade:"), fmt::format("Authorization: Bearer {}\r\n", token));
        return said;
    };
    SealedPeer kept = withLink(), socket = withLink();
    kept.say(get("/api", kWords.of(Role::kViewer)));
    ASSERT_NE(kept.hear("GetStatus").find(" 200 "), std::string::npos);
    socket.say(upgrade(kWords.of(Role::kEditor)));
    ASSERT_NE(socket.hear("\r\n\r\n").find(" 101 "), std::string::npos) << socket.heard();
    std::vector<std::unique_ptr<SealedPeer>> plainSockets;
    for (const std::string& token : {kWords.of(Role::kOperator), std::string("visits-the-panel")}) {
        plainSockets.push_back(std::make_unique<SealedPeer>((*plain)->address().port));
        std::string said = upgrade(token);
        said.replace(said.find(host), host.size(), plainHost);
        plainSockets.back()->sayPlain(said);
        ASSERT_NE(plainSockets.back()->hear("\r\n\r\n").find(" 101 "), std::string::npos);
    }
    door->renew(anew, {});
    (*plain)->renew(anew, {{"visits-it-again", "0123", "Hall"}});
    EXPECT_TRUE(kept.closes()) << "a connection that rests";
    EXPECT_TRUE(socket.closes());
    EXPECT_NE(socket.heard().find("its token has ended"), std::string::npos) << socket.heard();
    for (const auto& each : plainSockets) {
        EXPECT_TRUE(each->closes());
        EXPECT_NE(each->heard().find("its token has ended"), std::string::npos) << each->heard();
    }
    SealedPeer again = withLink(), other = withLink();
    again.say(get("/api", kWords.of(Role::kViewer)));
    const std::string refused = again.hear("}}\n");
    EXPECT_TRUE(refused.starts_with("HTTP/1.1 401 ")) << refused;
    EXPECT_WORDS(bodyOf(refused));
    other.say(get("/api", anew.of(Role::kViewer)));
    EXPECT_NE(other.hear("GetStatus").find(" 200 "), std::string::npos);
}

TEST_F(SealedDoor, OfOneNameThereAreNoMoreThanLeaveRoomForOthers) {
    const std::string word = freshToken(), other = freshToken();
    for (const auto& [name, said] : {std::pair("ci", word), std::pair("ada", other)})
        keys.tokens.push_back(
            {.hash = hashOfToken(said), .pass = {name, Role::kViewer}, .until = std::chrono::system_clock::now() + 1h});
    current.store(contextOf(keys));
    const auto opened = [&](const std::string& with, int most) {
        int count = 0;
        for (int i = 0; i < most; ++i) {
            sockets.push_back(std::make_unique<SealedPeer>(door->address().port, contextOf(cave().pinned())));
            std::string upgrade = openSocket();
            upgrade.insert(upgrade.find("Upgrade:"), fmt::format("Authorization: Bearer {}\r\n", with));
            sockets.back()->say(upgrade);
            if (sockets.back()->hear("\r\n\r\n").find(" 101 ") == std::string::npos) {
                EXPECT_NE(sockets.back()->heard().find("503"), std::string::npos) << sockets.back()->heard();
                break;
            }
            ++count;
        }
        return count;
    };
    EXPECT_EQ(opened(word, 48), 24) << "half of all";
    EXPECT_EQ(opened(other, 48), 12) << "half of what is left";
    EXPECT_EQ(opened(kWords.of(Role::kViewer), 48), 12) << "the server's user has the rest";
}

/// Its look at the keys is a timer: whenever that is due it does not keep the door from ending.
TEST_F(SealedDoor, EndsWheneverItLooksAtItsKeys) {
    std::mt19937 random(1);
    for (int round = 0; round < 40; ++round) {
        DoorOptions options{.listen = {"127.0.0.1", 0},
                            .server = {"127.0.0.1", backlog.port},
                            .wall = "cave",
                            .tokens = kWords,
                            .reach = {.keys = [this] { return current.load(); }}};
        options.reach.look = std::chrono::milliseconds(0);
        auto another = Door::open(options);
        ASSERT_TRUE(another);
        test::aMoment(random, 1200us);
    }
}

TEST_F(SealedDoor, AnswersPlainHttpInPlainWords) {
    for (const std::string& said : {get("/api", kWords.of(Role::kOperator)), std::string("G"), std::string("\r\n")}) {
        SealedPeer peer(door->address().port);
        peer.sayPlain(said);
        const std::string answer = peer.hear("}}\n");
        EXPECT_TRUE(answer.starts_with("HTTP/1.1 400 ")) << answer;
        EXPECT_WORDS(bodyOf(answer));
        EXPECT_TRUE(peer.closes());
    }
}

TEST_F(SealedDoor, OutlivesHandshakesThatAreNone) {
    for (const std::string& said : {std::string("\x16\x03\x01\0\x05hello", 10), std::string(20'000, '\x16'),
                                    std::string("\x16\x03\x01\xff\xff") + std::string(70'000, 'x')}) {
        SealedPeer peer(door->address().port);
        peer.sayPlain(said);
        EXPECT_TRUE(peer.closes());
    }
    SealedPeer broken = withLink();  // what is not what was sent
    broken.sayPlain("GET / HTTP/1.1\r\n\r\n and more of it, in plain");
    EXPECT_TRUE(broken.closes());
    SealedPeer peer = withLink();
    EXPECT_TRUE(peer.ready()) << peer.fault();
}

TEST_F(SealedDoor, WaitsForASlowHandshakeAsLongAsForAHead) {
    const std::uint16_t port = door->address().port;
    const auto from = std::chrono::steady_clock::now();
    SealedPeer silent(port), half(port), shaken = withLink(), headless = withLink();
    half.sayPlain("\x16\x03\x01\x02");
    headless.say("GET /api HT");
    for (SealedPeer* each : {&silent, &half, &shaken, &headless}) {
        EXPECT_TRUE(each->closes());
        EXPECT_GT(std::chrono::steady_clock::now() - from, 9s);
    }
    for (const SealedPeer* each : {&shaken, &headless}) EXPECT_NE(each->heard().find("408"), std::string::npos);
}

TEST_F(SealedDoor, LetsThoseWhoSayNothingGiveWay) {
    std::vector<std::unique_ptr<SealedPeer>> crowd;
    for (int i = 0; i < 300; ++i) {
        crowd.push_back(std::make_unique<SealedPeer>(door->address().port));
        if (i % 2 == 0) crowd.back()->sayPlain("\x16");
    }
    SealedPeer peer = withLink();
    ASSERT_TRUE(peer.ready()) << peer.fault();
    peer.say(get("/api", kWords.of(Role::kViewer)));
    EXPECT_TRUE(peer.hear("GetStatus").starts_with("HTTP/1.1 200 "));
}

TEST_F(SealedDoor, TakesRequestsHoweverTheyAreCut) {
    SealedPeer peer = withLink();
    const std::string one = get("/style.css");
    peer.say(one + one + one.substr(0, 10));
    peer.say(one.substr(10, 1));
    peer.say(one.substr(11));
    peer.say(get("/none", kWords.of(Role::kViewer)));
    const std::string answers = peer.hear("there is nothing here");
    std::size_t count = 0;
    for (std::size_t at = 0; (at = answers.find("HTTP/1.1 200 ", at)) != std::string::npos; ++at) ++count;
    EXPECT_EQ(count, 3u);
    // A body of many records, and an answer of many.
    SealedPeer large = withLink();
    large.say(fmt::format("POST /api/GetStatus HTTP/1.1\r\n{}Authorization: Bearer {}\r\nContent-Length: {}\r\n\r\n{}",
                          host, kWords.of(Role::kViewer), 3'000'000, std::string(3'000'000, ' ')));
    EXPECT_TRUE(large.hear("}}\n").starts_with("HTTP/1.1 400 ")) << large.heard();
    SealedPeer page = withLink();
    page.say(get("/api.html?token=" + kWords.of(Role::kViewer)));
    const std::string html = page.hear("</html>");
    EXPECT_GT(html.size(), 40'000u);
    EXPECT_TRUE(html.ends_with("</html>\n"));
}

TEST_F(SealedDoor, AsksForThisMachinesNamesAndItsOwnPages) {
    const std::uint16_t port = door->address().port;
    const auto status = [&](const std::string& called, const std::string& origin) {
        SealedPeer peer = withLink();
        peer.say(fmt::format("GET /api HTTP/1.1\r\nHost: {}\r\n{}Authorization: Bearer {}\r\n\r\n", called,
                             origin.empty() ? "" : "Origin: " + origin + "\r\n", kWords.of(Role::kViewer)));
        return peer.hear("\r\n").substr(9, 3);
    };
    EXPECT_EQ(status(fmt::format("localhost:{}", port), fmt::format("https://localhost:{}", port)), "200");
    EXPECT_EQ(status(fmt::format("evil.example:{}", port), ""), "421");
    EXPECT_EQ(status(fmt::format("localhost:{}", port), fmt::format("http://localhost:{}", port)), "403");
    EXPECT_EQ(status(fmt::format("localhost:{}", port), "https://evil.example"), "403");
}

TEST_F(SealedDoor, OpensBeyondThisMachineWithKeysOrOpenly) {
    const DoorOptions options{.listen = {"0.0.0.0", 0}, .server = {"127.0.0.1", 1}, .wall = "cave", .tokens = kWords};
    const auto refused = Door::open(options);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kUsage);
    DoorOptions sealed = options, open = options;
    sealed.reach.keys = [this] { return current.load(); };
    open.reach.open = true;
    const auto https = Door::open(sealed), http = Door::open(open);
    ASSERT_TRUE(https && http);
    EXPECT_TRUE((*https)->linkWith("t").starts_with("https://"));
    EXPECT_TRUE((*http)->linkWith("t").starts_with("http://"));
    EXPECT_EQ((*http)->linkWith("t").find("0.0.0.0"), std::string::npos);
    EXPECT_EQ((*http)->linkWith("t").find("authority"), std::string::npos);
    SealedPeer peer((*http)->address().port);
    peer.say(fmt::format("GET /authority.crt HTTP/1.1\r\nHost: localhost:{}\r\n\r\n", (*http)->address().port));
    EXPECT_TRUE(peer.hear("\r\n\r\n").starts_with("HTTP/1.1 404 "));
}

/// Whoever waits to be admitted is not, once the door has ended: nobody would see it out.
TEST_F(SealedDoor, EndsWhileACrowdWaitsForRoom) {
    for (int round = 0; round < 10; ++round) {
        const std::uint16_t port = door->address().port;
        std::vector<std::unique_ptr<SealedPeer>> crowd;
        for (int i = 0; i < 600; ++i) crowd.push_back(std::make_unique<SealedPeer>(port));
        EXPECT_TRUE(crowd.front()->closes()) << "from now on the others come in one after the other";
        door.reset();  // or else forever
        openDoor();
    }
}

}  // namespace
}  // namespace tessera
