/// Real sockets on loopback: strangers, floods, garbage; and a VRPN server that hangs, lies and comes back.
#include <gtest/gtest.h>

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include "TrackerBytes.h"
#include "server/sim/tracking/TrackerInputs.h"
#include "tests/support/words/Words.h"
#include "tests/unit/Eventually.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;

sockaddr_in loopback(std::uint16_t port, const char* host = "127.0.0.1") {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    inet_pton(AF_INET, host, &address.sin_addr);
    return address;
}

/// A bound socket of either kind; its port was free.
class LoopbackSocket {
public:
    explicit LoopbackSocket(int kind, const char* host = "127.0.0.1") : fd_(socket(AF_INET, kind | SOCK_CLOEXEC, 0)) {
        const int yes = 1;
        setsockopt(fd_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
        sockaddr_in address = loopback(0, host);
        EXPECT_EQ(bind(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
        socklen_t size = sizeof address;
        getsockname(fd_, reinterpret_cast<sockaddr*>(&address), &size);
        port_ = ntohs(address.sin_port);
    }
    explicit LoopbackSocket(std::pair<int, std::uint16_t> made) : fd_(made.first), port_(made.second) {}
    ~LoopbackSocket() { close(fd_); }
    LoopbackSocket(const LoopbackSocket&) = delete;
    void sendTo(std::uint16_t port, const Bytes& bytes) const {
        const sockaddr_in to = loopback(port);
        sendto(fd_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
    }
    [[nodiscard]] int fd() const { return fd_; }
    [[nodiscard]] std::uint16_t port() const { return port_; }

private:
    int fd_;
    std::uint16_t port_ = 0;
};
/// A port that nobody listens at just now.
std::uint16_t freePort(int kind) {
    return LoopbackSocket(kind).port();
}

/// One tracker, heard.
struct HeardTracker {
    explicit HeardTracker(WallTracker setup) {
        setup.name = "art";
        inputs.emplace(WallTracking{.trackers = {std::move(setup)}}, platform, log);
        const Expected<void> opened = inputs->open();
        EXPECT_TRUE(opened.has_value()) << opened.error().message;
    }
    /// All readings until `enough` says so, at most ten seconds.
    template <typename Enough>
    std::vector<TrackerReading> until(Enough enough) {
        std::vector<TrackerReading> all;
        (void)test::eventually(
            [&] {
                if (enough(all)) return true;
                for (TrackerReading& reading : inputs->take()) {
                    ends += reading.connectionEnded ? 1 : 0;
                    if (!reading.reports.empty()) all.push_back(std::move(reading));
                }
                return false;
            },
            10s);
        return all;
    }
    TrackerInfo told() {
        std::vector<TrackerInfo> infos(1);
        inputs->describe(infos);
        return infos[0];
    }
    Platform platform;
    Log log{"test", std::fopen("/dev/null", "w")};
    std::optional<TrackerInputs> inputs;
    int ends = 0;  ///< of connections, as frames are told
};

Bytes dtrackBody(int frame, const test::SentPose& pose = {}) {
    return test::bytesOf(fmt::format("fr {}\r\n6d 1 [0 1.000]", frame) + test::dtrackBlocks(pose, true) + "\r\n");
}
Bytes oscPosition(float x) {
    return test::WireWriter().text("/tessera/0/position").text(",fff").f32(x).f32(0).f32(0).bytes;
}

TEST(TrackerInputs, HandsOverWhatIsSentInItsOrderWithTheTimeOfItsComing) {
    const std::uint16_t port = freePort(SOCK_DGRAM);
    HeardTracker tracker({.protocol = TrackerProtocol::kOsc, .address = fmt::format("127.0.0.1:{}", port)});
    const LoopbackSocket sender(SOCK_DGRAM);
    const TimePoint before = clockNow();
    for (int i = 0; i < 100; ++i) sender.sendTo(port, oscPosition(static_cast<float>(i)));
    const auto readings = tracker.until([](const auto& all) { return all.size() == 100; });
    ASSERT_EQ(readings.size(), 100u);
    TimePoint last = before;
    for (std::size_t i = 0; i < 100; ++i) {
        EXPECT_EQ(readings[i].reports.at(0).pose->position.x(), static_cast<double>(i));
        EXPECT_GE(readings[i].at, last);
        last = readings[i].at;
    }
    EXPECT_LE(last, clockNow());
}

TEST(TrackerInputs, GarbageIsCountedAndEndsNothing) {
    const std::uint16_t port = freePort(SOCK_DGRAM);
    HeardTracker tracker({.address = fmt::format("127.0.0.1:{}", port)});
    const LoopbackSocket sender(SOCK_DGRAM);
    const unsigned seed = test::trackerSeed(8);
    TESSERA_TRACKER_SEED(seed, "TrackerInputs.Garbage*");
    std::mt19937 random(seed);
    for (int i = 0; i < 100; ++i) {
        Bytes rubbish(random() % 2000);
        for (std::byte& byte : rubbish) byte = static_cast<std::byte>(random());
        sender.sendTo(port, rubbish);
        // One at a time: a port has room for few.
        EXPECT_TRUE(
            tracker.until([&](const auto&) { return tracker.told().malformed > static_cast<unsigned>(i); }).empty());
    }
    sender.sendTo(port, dtrackBody(1));
    const auto readings = tracker.until([](const auto& all) { return !all.empty(); });
    EXPECT_EQ(readings.size(), 1u);
    EXPECT_EQ(tracker.told().malformed, 100u);
    EXPECT_FALSE(tracker.told().trouble.empty());
}

/// Sent from 127.0.0.2, which loopback has too.
TEST(TrackerInputs, AStrangersFloodIsNotReadAndKeepsNobodyFromBeingHeard) {
    const std::uint16_t port = freePort(SOCK_DGRAM);
    HeardTracker tracker({.address = fmt::format("0.0.0.0:{}", port), .allowFrom = {"127.0.0.1"}});
    const LoopbackSocket sender(SOCK_DGRAM), stranger(SOCK_DGRAM, "127.0.0.2");
    std::size_t heard = 0;
    for (int frame = 0; frame < 20; ++frame) {
        for (int i = 0; i < 1000; ++i) stranger.sendTo(port, dtrackBody(i));
        // What the flood had in the port's buffer when this came is lost with it: a tracker says the next one.
        heard += tracker.until([&](const auto& all) {
                            if (all.empty()) sender.sendTo(port, dtrackBody(frame));
                            return !all.empty();
                        })
                         .empty()
                     ? 0
                     : 1;
    }
    EXPECT_EQ(heard, 20u);
    EXPECT_GE(tracker.told().datagrams, 20u);
    EXPECT_GT(tracker.told().strangers, 1000u);
}

TEST(TrackerInputs, AFloodOfPosesIsReadUpToItsBound) {
    const std::uint16_t port = freePort(SOCK_DGRAM);
    HeardTracker tracker({.address = fmt::format("127.0.0.1:{}", port)});
    const LoopbackSocket sender(SOCK_DGRAM);
    std::uint64_t sent = 0;
    // Nobody takes: the channel fills, and what is beyond it is counted.
    const TimePoint deadline = clockNow() + 20s;
    while (tracker.told().datagrams - tracker.told().tooMany < TrackerInputs::kMostWaiting && clockNow() < deadline)
        for (int i = 0; i < 100; ++i) sender.sendTo(port, dtrackBody(static_cast<int>(sent++)));
    for (int i = 0; i < 2000; ++i) sender.sendTo(port, dtrackBody(static_cast<int>(sent++)));
    const auto readings = tracker.until([&](const auto& all) { return all.size() >= TrackerInputs::kMostWaiting; });
    EXPECT_GE(readings.size(), TrackerInputs::kMostWaiting);
    EXPECT_GT(tracker.told().tooMany, 0u);
}

TEST(TrackerInputs, APortThatIsTakenIsNamed) {
    const LoopbackSocket taken(SOCK_DGRAM);
    Log log("test", std::fopen("/dev/null", "w"));
    WallTracker setup{.name = "art", .address = fmt::format("127.0.0.1:{}", taken.port())};
    const Platform platform;
    TrackerInputs inputs(WallTracking{.trackers = {setup}}, platform, log);
    const Expected<void> opened = inputs.open();
    ASSERT_FALSE(opened.has_value());
    EXPECT_EQ(opened.error().code, ErrorCode::kNetwork);
    EXPECT_WORDS(opened.error().message);
}

/// A vrpn_server by the bytes of its protocol.
class ScriptedVrpn {
public:
    ScriptedVrpn() { EXPECT_EQ(listen(socket_.fd(), 4), 0); }
    [[nodiscard]] std::string url() const { return fmt::format("vrpn://127.0.0.1:{}/Tracker0", socket_.port()); }
    /// The next connection; its cookie is read.
    std::unique_ptr<LoopbackSocket> next() {
        auto connection =
            std::make_unique<LoopbackSocket>(std::pair(accept(socket_.fd(), nullptr, nullptr), socket_.port()));
        Bytes cookie(24);
        EXPECT_EQ(recv(connection->fd(), cookie.data(), cookie.size(), MSG_WAITALL), 24);
        EXPECT_TRUE(asText(cookie).starts_with("vrpn: ver. 07."));
        return connection;
    }
    static void say(const LoopbackSocket& connection, const Bytes& bytes) {
        std::size_t done = 0;
        while (done < bytes.size()) {
            const ssize_t count = send(connection.fd(), bytes.data() + done, bytes.size() - done, MSG_NOSIGNAL);
            if (count <= 0) return;
            done += static_cast<std::size_t>(count);
        }
    }
    static void greet(const LoopbackSocket& connection, const std::string& device = "Tracker0") {
        Bytes bytes = test::vrpnCookie();
        test::append(bytes, test::vrpnName(2, -1, device));
        test::append(bytes, test::vrpnName(1, -2, "vrpn_Tracker Pos_Quat"));
        say(connection, bytes);
    }

private:
    LoopbackSocket socket_{SOCK_STREAM};
};

TEST(TrackerInputs, AVrpnServerIsHeardLiesEndOneConnectionAndItsReturnIsHeard) {
    ScriptedVrpn server;
    HeardTracker tracker({.protocol = TrackerProtocol::kVrpn, .address = server.url()});
    {
        const auto first = server.next();
        ScriptedVrpn::greet(*first);
        ScriptedVrpn::say(*first, test::vrpnPose(2, 1, 0, {.position = {1, 2, 3}}));
        const auto readings = tracker.until([](const auto& all) { return !all.empty(); });
        ASSERT_EQ(readings.size(), 1u);
        EXPECT_EQ(readings[0].reports.at(0).pose->position, Vec3d(1, 2, 3));
        // A lie about a length: the connection is closed by us, and dialled again.
        ScriptedVrpn::say(*first, test::vrpnMessage(2, 1, Bytes(64), 0xfffffff0u));
        const auto second = server.next();
        char byte = 0;
        EXPECT_LE(recv(first->fd(), &byte, 1, 0), 0);
        EXPECT_EQ(tracker.told().malformed, 1u);
        EXPECT_WORDS(tracker.told().trouble);
        ScriptedVrpn::greet(*second);
        ScriptedVrpn::say(*second, test::vrpnPose(2, 1, 0, {.position = {4, 5, 6}}));
        EXPECT_EQ(tracker.until([](const auto& all) { return !all.empty(); }).size(), 1u);
        EXPECT_EQ(tracker.ends, 1) << "before what the next one says";
    }
    // It is gone, and comes again.
    const auto third = server.next();
    ScriptedVrpn::greet(*third);
    ScriptedVrpn::say(*third, test::vrpnPose(2, 1, 0, {.position = {7, 8, 9}}));
    const auto readings = tracker.until([](const auto& all) { return !all.empty(); });
    ASSERT_EQ(readings.size(), 1u);
    EXPECT_EQ(readings[0].reports.at(0).pose->position, Vec3d(7, 8, 9));
    EXPECT_EQ(tracker.ends, 2);
}

/// Nobody there, somebody who is no VRPN server, one that says nothing and leaves: each is told as what it is.
TEST(TrackerInputs, WhoIsThereAndSpeaksSomethingElseIsNotToldAsAbsent) {
    const auto toldAs = [](HeardTracker& tracker, const char* words) {
        tracker.until([&](const auto&) { return tracker.told().trouble.find(words) != std::string::npos; });
        return tracker.told().trouble.find(words) != std::string::npos;
    };
    HeardTracker nobody({.protocol = TrackerProtocol::kVrpn,
                         .address = fmt::format("vrpn://127.0.0.1:{}/Tracker0", freePort(SOCK_STREAM))});
    EXPECT_TRUE(toldAs(nobody, "is not there")) << nobody.told().trouble;
    ScriptedVrpn server;
    HeardTracker tracker({.protocol = TrackerProtocol::kVrpn, .address = server.url()});
    ScriptedVrpn::say(*server.next(), test::bytesOf("HTTP/1.1 400 Bad Request\r\n\r\n"));
    EXPECT_TRUE(toldAs(tracker, "does not speak VRPN 7")) << tracker.told().trouble;
    {
        const auto connection = server.next();
        ScriptedVrpn::greet(*connection);
        tracker.until([&](const auto&) { return tracker.told().trouble.empty(); });
        EXPECT_EQ(tracker.told().trouble, "");
    }
    EXPECT_TRUE(toldAs(tracker, "has ended the connection")) << tracker.told().trouble;
    ScriptedVrpn::say(*server.next(), test::bytesOf("vrpn: ver. 08.00  0"));
    EXPECT_TRUE(toldAs(tracker, "does not speak VRPN 7")) << tracker.told().trouble;
}

TEST(TrackerInputs, AVrpnServerWithoutTheDeviceIsNamed) {
    ScriptedVrpn server;
    HeardTracker tracker({.protocol = TrackerProtocol::kVrpn, .address = server.url()});
    ScriptedVrpn::greet(*server.next(), "Tracker1");
    EXPECT_TRUE(tracker.until([&](const auto&) { return !tracker.told().trouble.empty(); }).empty());
    EXPECT_WORDS(tracker.told().trouble);
}

/// It is connected and never silent: only what it speaks of says that the name is wrong.
TEST(TrackerInputs, AVrpnServerThatSpeaksOfOtherDevicesForEverIsNamed) {
    ScriptedVrpn server;
    HeardTracker tracker({.protocol = TrackerProtocol::kVrpn, .address = server.url()});
    const auto connection = server.next();
    ScriptedVrpn::greet(*connection, "Tracker1");
    EXPECT_TRUE(test::eventually([&] {
        ScriptedVrpn::say(*connection, test::vrpnPose(2, 1, 0, {.position = {1, 2, 3}}));
        return !tracker.told().trouble.empty();
    }));
    EXPECT_WORDS(tracker.told().trouble);
}

TEST(SocketFeeds, AStreamThatHangsIsDialledAgain) {
    ScriptedVrpn server;
    SocketFeeds feeds;
    std::atomic<int> lost = 0;
    feeds.dial(*parseAddress(server.url().substr(7, server.url().find('/', 7) - 7)),
               {.opened = [] { return test::vrpnCookie(); },
                .received = [](ByteSpan, TimePoint) { return Expected<void>(); },
                .lost = [&](const Error&) { ++lost; },
                .silence = 50ms,
                .firstPause = 10ms});
    const auto first = server.next(), second = server.next(), third = server.next();
    EXPECT_GE(lost, 2);
}

TEST(SocketFeeds, NobodyThereIsSaidAndDialledAgain) {
    SocketFeeds feeds;
    std::atomic<int> lost = 0;
    feeds.dial({.host = "127.0.0.1", .port = freePort(SOCK_STREAM)},
               {.opened = [] { return Bytes(); },
                .received = [](ByteSpan, TimePoint) { return Expected<void>(); },
                .lost = [&](const Error& why) { lost += why.message.empty() ? 0 : 1; },
                .firstPause = 5ms,
                .longestPause = 5ms});
    EXPECT_TRUE(test::eventually([&] { return lost >= 3; }));
}

TEST(HostRange, HoldsWhatItSharesBitsWith) {
    const auto bytesOf = [](const char* text) { return parseHostRange(text)->first; };
    EXPECT_TRUE(parseHostRange("10.0.0.5")->contains(bytesOf("10.0.0.5")));
    EXPECT_FALSE(parseHostRange("10.0.0.5")->contains(bytesOf("10.0.0.4")));
    EXPECT_TRUE(parseHostRange("10.1.0.0/15")->contains(bytesOf("10.1.255.255")));
    EXPECT_TRUE(parseHostRange("10.0.0.0/15")->contains(bytesOf("10.1.255.255")));
    EXPECT_FALSE(parseHostRange("10.0.0.0/15")->contains(bytesOf("10.2.0.0")));
    EXPECT_TRUE(parseHostRange("0.0.0.0/0")->contains(bytesOf("255.1.2.3")));
    EXPECT_FALSE(parseHostRange("0.0.0.0/0")->contains(bytesOf("fd00::1")));
    EXPECT_TRUE(parseHostRange("fd00::/8")->contains(bytesOf("fdff::7")));
    for (const char* bad : {"", "host", "10.0.0", "10.0.0.0/33", "10.0.0.0/-1", "10.0.0.0/", "10.0.0.0/8x", "::/129"})
        EXPECT_FALSE(parseHostRange(bad).has_value()) << bad;
}

}  // namespace
}  // namespace tessera
