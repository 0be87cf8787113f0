/// VRPN's bytes, as its sources describe them, in pieces of any size; and servers that lie.
#include <gtest/gtest.h>

#include "TrackerBytes.h"
#include "server/sim/tracking/VrpnStream.h"
#include "tests/support/words/Words.h"

namespace tessera {
namespace {

using test::append;
using test::SentPose;
using test::vrpnCookie;
using test::vrpnMessage;
using test::vrpnName;
using test::vrpnPose;
using test::WireWriter;

constexpr std::int32_t kSender = -1, kType = -2;

/// What a server says before its first pose: names in an order and with numbers of its own.
Bytes vrpnGreeting() {
    Bytes bytes = vrpnCookie();
    append(bytes, vrpnMessage(3883, -3, test::bytesOf("10.0.0.5")));  // its port for datagrams, which we leave alone
    append(bytes, vrpnName(0, kSender, "VRPN Control"));
    append(bytes, vrpnName(5, kSender, "Tracker0"));
    append(bytes, vrpnName(6, kSender, "Button0"));
    append(bytes, vrpnName(0, kType, "VRPN_Connection_Got_Connection"));
    append(bytes, vrpnName(3, kType, "vrpn_Tracker Pos_Quat"));
    append(bytes, vrpnName(4, kType, "vrpn_Tracker Velocity"));
    append(bytes, vrpnName(9, kType, "vrpn_Button Change"));
    append(bytes, vrpnName(10, kType, "vrpn_Analog Channel"));
    append(bytes, vrpnName(11, kType, "vrpn_Button States"));
    return bytes;
}

TEST(VrpnStream, ReadsPosesButtonsAndAxesInPiecesOfAnySize) {
    const unsigned seed = test::trackerSeed(3);
    TESSERA_TRACKER_SEED(seed, "VrpnStream.ReadsPoses*");
    std::mt19937 random(seed);
    for (int round = 0; round < 200; ++round) {
        Bytes bytes = vrpnGreeting();
        std::vector<SentPose> sent;
        for (int i = 0; i < 10; ++i) {
            sent.push_back(test::randomPose(random));
            append(bytes, vrpnPose(5, 3, i, sent.back()));
            append(bytes, vrpnPose(0, 3, i, {}));                     // another device's
            append(bytes, vrpnMessage(5, 4, Bytes(random() % 100)));  // velocities
        }
        append(bytes, vrpnMessage(6, 9, WireWriter().i32(2).i32(1).bytes));
        append(bytes, vrpnMessage(5, 10, WireWriter().f64(2).f64(0.5).f64(-1).bytes));
        append(bytes, vrpnMessage(6, 11, WireWriter().i32(3).i32(1).i32(0).i32(1).bytes));
        VrpnStream stream({.tracker = "Tracker0", .buttons = "Button0", .analogs = ""});
        std::vector<SensorReport> reports;
        for (std::size_t at = 0; at < bytes.size();) {
            const std::size_t count =
                std::min<std::size_t>(1 + random() % (round % 2 == 0 ? 7 : 500), bytes.size() - at);
            const auto some = stream.take(ByteSpan(bytes).subspan(at, count));
            ASSERT_TRUE(some.has_value()) << some.error().message;
            reports.insert(reports.end(), some->begin(), some->end());
            at += count;
        }
        EXPECT_TRUE(stream.knowsTracker());
        ASSERT_EQ(reports.size(), 13u);
        for (std::size_t i = 0; i < 10; ++i) {
            EXPECT_EQ(reports[i].sensor.number, static_cast<int>(i));
            EXPECT_EQ(reports[i].pose->position, sent[i].position);
            EXPECT_EQ(reports[i].pose->orientation.coeffs(), sent[i].orientation.coeffs());
        }
        EXPECT_EQ(reports[10].buttons, 4u);
        EXPECT_EQ(reports[11].axes[0], 0.5);
        EXPECT_EQ(reports[11].axesSaid, 3u);
        EXPECT_EQ(reports[12].buttons, 5u);
        EXPECT_EQ(reports[12].buttonsSaid, 7u);
    }
}

TEST(VrpnStream, SaysTheCookieThatServersExpect) {
    const Bytes cookie = VrpnStream::cookie();
    ASSERT_EQ(cookie.size(), 24u);
    EXPECT_EQ(asText(cookie).substr(0, 19), "vrpn: ver. 07.35  0");
}

TEST(VrpnStream, RefusesStrangersVersionsAndLies) {
    const auto refused = [](const Bytes& bytes) {
        VrpnStream stream({.tracker = "Tracker0"});
        const auto read = stream.take(bytes);
        return read ? std::string() : read.error().message;
    };
    EXPECT_WORDS(refused(test::bytesOf("HTTP/1.1 400 Bad Request")));
    EXPECT_WORDS(refused(vrpnCookie("vrpn: ver. 06.00  0")));
    for (const std::uint32_t claim : {0u, 23u, 70'000u, 0x7fffffffu, 0xffffffffu}) {
        Bytes bytes = vrpnGreeting();
        append(bytes, vrpnMessage(5, 3, Bytes(64), claim));
        EXPECT_FALSE(refused(bytes).empty()) << claim;
    }
    Bytes shorter = vrpnGreeting();
    append(shorter, vrpnMessage(5, 3, Bytes(16)));
    EXPECT_FALSE(refused(shorter).empty());
    Bytes name = vrpnCookie();
    append(name, vrpnMessage(1, kSender, WireWriter().u32(1'000'000).bytes));
    EXPECT_FALSE(refused(name).empty());
    Bytes names = vrpnCookie();
    for (int i = 0; i < 3000; ++i) append(names, vrpnName(i, kType, fmt::format("type {}", i)));
    EXPECT_WORDS(refused(names));
}

TEST(VrpnStream, SurvivesMutatedBytes) {
    const unsigned seed = test::trackerSeed(4);
    TESSERA_TRACKER_SEED(seed, "VrpnStream.Survives*");
    std::mt19937 random(seed);
    for (int round = 0; round < 5000; ++round) {
        Bytes bytes = vrpnGreeting();
        for (int i = 0; i < 5; ++i) append(bytes, vrpnPose(5, 3, i, test::randomPose(random)));
        bytes = test::mutated(bytes, random);
        VrpnStream stream({.tracker = "Tracker0"});
        const auto read = stream.take(bytes);
        if (read) {
            EXPECT_LE(read->size(), 5u);
        } else {
            EXPECT_FALSE(read.error().message.empty());
        }
    }
}

}  // namespace
}  // namespace tessera
