/// Whoever knocks on the server's port with something else than the protocol disturbs nobody.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstring>
#include <memory>
#include <random>
#include <thread>

#include "common/base/Channel.h"
#include "common/codec/ApplicationCodec.h"
#include "common/codec/MessageCodec.h"
#include "common/net/FrameHeader.h"
#include "common/net/TcpTransport.h"
#include "common/scene/FieldTable.h"
#include "tests/integration/MessageBytes.h"
#include "tests/integration/ThreadWall.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;

/// A plain TCP connection.
class Knock {
public:
    explicit Knock(const std::string& address) {
        const auto parsed = parseAddress(address);
        socket_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
        sockaddr_in to{};
        to.sin_family = AF_INET;
        to.sin_port = htons(parsed->port);
        inet_pton(AF_INET, parsed->host.c_str(), &to.sin_addr);
        connected_ = connect(socket_, reinterpret_cast<sockaddr*>(&to), sizeof to) == 0;
    }
    ~Knock() { close(socket_); }
    [[nodiscard]] bool connected() const { return connected_; }
    void say(ByteSpan bytes) const { (void)!::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL); }
    /// As much as the other side has room for within a moment; how many bytes that were.
    [[nodiscard]] std::size_t saySome(ByteSpan bytes) const {
        const timeval wait{.tv_sec = 0, .tv_usec = 50'000};
        setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &wait, sizeof wait);
        return static_cast<std::size_t>(
            std::max<ssize_t>(0, ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL)));
    }
    /// Of the first message that comes: the server's epoch. Zero where none comes.
    [[nodiscard]] Epoch hearEpoch() const {
        const timeval wait{.tv_sec = 10, .tv_usec = 0};
        setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &wait, sizeof wait);
        std::array<std::byte, FrameHeader::kBytes> header{};
        if (recv(socket_, header.data(), header.size(), MSG_WAITALL) != static_cast<ssize_t>(header.size())) return {};
        const auto decoded = decodeHeader(header);
        return decoded ? decoded->epoch : Epoch();
    }
    /// Whether the server closes within the time.
    [[nodiscard]] bool closedWithin(std::chrono::milliseconds timeout) const {
        const timeval wait{.tv_sec = timeout.count() / 1000, .tv_usec = timeout.count() % 1000 * 1000};
        setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &wait, sizeof wait);
        char buffer[4096];
        for (;;) {
            const ssize_t n = recv(socket_, buffer, sizeof buffer, 0);
            if (n == 0 || (n < 0 && errno == ECONNRESET)) return true;
            if (n < 0) return false;
        }
    }

private:
    int socket_ = -1;
    bool connected_ = false;
};

class Strangers : public testing::Test {
protected:
    /// They all come to the same wall.
    static void SetUpTestSuite() {
        started_ = std::make_unique<ThreadWall>(LiveWallOptions{});
        ASSERT_FALSE(started_->address().empty()) << started_->server().output();
        for (const std::string& host : kFourHosts) started_->startClient(host);
        ASSERT_TRUE(started_->waitForFrame("front-0-0", 3, 30s)) << started_->logs();
    }
    static void TearDownTestSuite() {
        const nlohmann::json report = started_->finish();
        ASSERT_FALSE(report.is_null()) << started_->logs();
        EXPECT_TRUE(report["faults"].empty()) << report["faults"].dump(2);
        started_.reset();
    }
    void TearDown() override {
        const std::int64_t now = wall_.shownFrame("front-0-0");
        EXPECT_TRUE(wall_.waitForFrame("front-0-0", now + 10, 10s)) << wall_.logs();
    }
    ThreadWall& wall_ = *started_;

private:
    static inline std::unique_ptr<ThreadWall> started_;
};

TEST_F(Strangers, GarbageIsHungUpOn) {
    std::mt19937 random(7);
    for (int i = 0; i < 20; ++i) {
        const Knock knock(wall_.address());
        ASSERT_TRUE(knock.connected());
        Bytes noise(64 + random() % 4000);
        for (std::byte& b : noise) b = static_cast<std::byte>(random());
        knock.say(noise);
        EXPECT_TRUE(knock.closedWithin(5s));
    }
    const Knock web(wall_.address());
    web.say(asBytes("GET / HTTP/1.1\r\nHost: wall\r\n\r\n"));
    EXPECT_TRUE(web.closedWithin(5s));
}

TEST_F(Strangers, AFourGigabyteLengthTakesNoMemory) {
    std::array<std::byte, FrameHeader::kBytes> header = encodeHeader(wireType(Message(message::Hello{})), {}, {});
    const std::uint32_t huge = 0xffffffffu;
    std::memcpy(header.data() + 8, &huge, sizeof huge);
    const Knock knock(wall_.address());
    knock.say(header);
    EXPECT_TRUE(knock.closedWithin(5s));
}

TEST_F(Strangers, SilentConnectionsAreClosedAfterTheHelloDeadline) {
    std::vector<std::unique_ptr<Knock>> silent;
    for (int i = 0; i < 10; ++i) silent.push_back(std::make_unique<Knock>(wall_.address()));
    // Half of a header, then nothing.
    silent[0]->say(ByteSpan(encodeHeader(1, {}, {})).first(11));
    for (const auto& knock : silent) EXPECT_TRUE(knock->closedWithin(6s));
}

TEST_F(Strangers, AMessageThatOnlyAHostMaySayEndsTheConnection) {
    const ByteChain payload =
        encodeMessage(message::Ready{.frame = FrameNumber(4), .stateHash = StateHash(1), .stats = nullptr});
    const auto header = encodeHeader(wireType(Message(message::Ready{})), {}, payload);
    const Knock knock(wall_.address());
    knock.say(header);
    knock.say(payload.joined());
    EXPECT_TRUE(knock.closedWithin(5s));
}

TEST_F(Strangers, AnApplicationThatSpeaksOfAnotherEpochIsHungUpOn) {
    const Knock knock(wall_.address());
    knock.say(messageBytes(
        {}, message::Hello{
                .schema = schemaHash(), .role = PeerRole::kApplication, .name = "late", .access = wall_.token()}));
    const Epoch epoch = knock.hearEpoch();
    ASSERT_TRUE(epoch);
    knock.say(messageBytes(epoch.next(), message::Request{1, share(encodeRequest(request::GetStatus{}))}));
    EXPECT_TRUE(knock.closedWithin(5s));
}

TEST_F(Strangers, AnApplicationThatAsksWithoutEndAndNeverListensHoldsUpNobody) {
    const Knock knock(wall_.address());
    knock.say(messageBytes(
        {}, message::Hello{
                .schema = schemaHash(), .role = PeerRole::kApplication, .name = "greedy", .access = wall_.token()}));
    const Epoch epoch = knock.hearEpoch();
    ASSERT_TRUE(epoch);
    Bytes many;
    for (std::uint64_t i = 0; i < 1000; ++i) {
        const Bytes one = messageBytes(epoch, message::Request{i, share(encodeRequest(request::GetStatus{}))});
        many.insert(many.end(), one.begin(), one.end());
    }
    const std::size_t before = residentBytesOf(::getpid());
    const std::int64_t first = wall_.shownFrame("front-0-0");
    std::atomic<bool> enough = false;
    std::thread flood([&] {
        for (std::size_t at = 0; !enough; at %= many.size()) at += knock.saySome(ByteSpan(many).subspan(at));
    });
    EXPECT_TRUE(wall_.waitForFrame("front-0-0", first + 100, 30s)) << wall_.logs();
    EXPECT_LT(residentBytesOf(::getpid()), before + (std::size_t{32} << 20));
    EXPECT_EQ(wall_.ctl({"status"}).exitCode, 0);
    enough = true;
    flood.join();
}

/// Says hello and returns the Refused that comes back.
std::optional<message::Refused> refusalOf(const std::string& address, const message::Hello& hello) {
    Channel<LinkEvent> events(100);
    TcpTransport transport({.maxPayload = maxPayloadBytes}, [&](LinkEvent event) { events.push(std::move(event)); });
    const LinkId link = transport.connect(*parseAddress(address), 5s);
    const auto deadline = std::chrono::steady_clock::now() + 5s;
    while (std::chrono::steady_clock::now() < deadline) {
        const std::optional<LinkEvent> event = events.popFor(100ms);
        if (!event) continue;
        if (std::holds_alternative<link_event::Opened>(event->what)) {
            transport.send(link, wireType(Message(hello)), {}, share(encodeMessage(hello)));
        } else if (const auto* received = std::get_if<link_event::Received>(&event->what)) {
            const Expected<Message> message = decodeMessage(received->type, received->payload);
            if (message && std::holds_alternative<message::Refused>(*message)) {
                events.close();
                return std::get<message::Refused>(*message);
            }
        } else {
            break;
        }
    }
    events.close();
    return std::nullopt;
}

TEST(Farewell, AnApplicationThatDoesNotListenKeepsNobodyWaiting) {
    ThreadWall wall({});
    for (const std::string& host : kFourHosts) wall.startClient(host, {.surface = "none"});
    const Knock deaf(wall.address());
    deaf.say(messageBytes(
        {}, message::Hello{
                .schema = schemaHash(), .role = PeerRole::kApplication, .name = "deaf", .access = wall.token()}));
    ASSERT_TRUE(deaf.hearEpoch());
    ASSERT_TRUE(wall.server().waitForText("enters at frame", 30s)) << wall.logs();
    wall.server().stop();
    EXPECT_EQ(wall.server().waitForExit(5s), 0) << "a second for it to read, one for what is queued: " << wall.logs();
}

TEST_F(Strangers, AnotherProtocolVersionIsToldBothNumbers) {
    const auto refused = refusalOf(wall_.address(), {.protocol = kProtocolVersion + 7, .name = "upper-left"});
    ASSERT_TRUE(refused);
    EXPECT_NE(refused->reason.find(std::to_string(kProtocolVersion + 7)), std::string::npos) << refused->reason;
    EXPECT_NE(refused->reason.find(std::to_string(kProtocolVersion)), std::string::npos);
    EXPECT_FALSE(refused->retry);
}

TEST_F(Strangers, AnUnknownHostNameIsToldTheWallsNamesAndExits) {
    ThreadHost& stranger = wall_.startClient("middle");
    EXPECT_EQ(stranger.waitForExit(20s), 3) << stranger.output();
    for (const std::string& host : kFourHosts)
        EXPECT_NE(stranger.output().find(host), std::string::npos) << stranger.output();
}

}  // namespace
}  // namespace tessera::test
