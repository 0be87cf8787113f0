/// Datagrams of DTrack and OSC: what is said is read, and nothing else is believed.
#include <gtest/gtest.h>

#include "TrackerBytes.h"
#include "server/sim/tracking/DtrackParser.h"
#include "server/sim/tracking/OscParser.h"

namespace tessera {
namespace {

using test::bytesOf;
using test::dtrackBlocks;
using test::SentPose;
using test::WireWriter;

double turnBetween(const Quatd& a, const Quatd& b) {
    return a.angularDistance(b);
}

TEST(DtrackParser, ReadsEveryKindOfBody) {
    const SentPose pose{.position = {0.326848, -0.187216, 1.5},
                        .orientation = Quatd(Eigen::AngleAxisd(0.7, Vec3d(1, 2, -1).normalized()))};
    const std::string text = "fr 21753\r\nts 39596.024831\r\n6dcal 3\r\n6d 2 [0 1.000]" + dtrackBlocks(pose, true) +
                             " [4 0.500]" + dtrackBlocks(pose, true) + "\r\n6df 1 [1 1.000 5]" +
                             dtrackBlocks(pose, true) + "\r\n6df2 4 1 [2 1.000 40 2]" + dtrackBlocks(pose, false) +
                             "[2147483649 3 -0.50 1.00]\r\n6dmt 1 [7 1.000 1]" + dtrackBlocks(pose, false) +
                             "\r\n3d 2 [9 1.000][100.000 200.000 300.000] [10 0.900][1.0 2.0 3.0]\r\nglcal 0\r\n";
    const auto read = parseDtrack(bytesOf(text));
    ASSERT_TRUE(read.has_value()) << read.error().message;
    ASSERT_EQ(read->size(), 7u);
    const SensorName names[] = {{SensorKind::kBody, 0},     {SensorKind::kBody, 4}, {SensorKind::kFlystick, 1},
                                {SensorKind::kFlystick, 2}, {SensorKind::kTool, 7}, {SensorKind::kMarker, 9},
                                {SensorKind::kMarker, 10}};
    for (std::size_t i = 0; i < 7; ++i) {
        const SensorReport& report = (*read)[i];
        EXPECT_EQ(toString(report.sensor), toString(names[i]));
        ASSERT_TRUE(report.pose) << i;
        if (i >= 5) continue;
        EXPECT_LT((report.pose->position - 1000 * pose.position).norm(), 0.002) << i;
        EXPECT_LT(turnBetween(report.pose->orientation, pose.orientation), 1e-5) << i;
    }
    EXPECT_EQ((*read)[2].buttons, 5u);
    EXPECT_EQ((*read)[3].buttons, 0x80000001u);
    EXPECT_EQ((*read)[3].axesSaid, 3u);
    EXPECT_EQ((*read)[3].axes[0], -0.5);
    EXPECT_EQ((*read)[4].buttons, 1u);
    EXPECT_FALSE((*read)[5].pose->turns);
    EXPECT_EQ((*read)[5].pose->position, Vec3d(100, 200, 300));
}

TEST(DtrackParser, LeavesOutABodyThatIsNotSeenAndKeepsItsButtons) {
    const std::string zeros =
        "[0.000 0.000 0.000][0.000000 0.000000 0.000000 0.000000 0.000000 0.000000 0.000000 0.000000 0.000000]";
    const auto read = parseDtrack(bytesOf("fr 1\r\n6df2 1 1 [0 -1.000 4 1]" + zeros + "[3 0.25]\r\n"));
    ASSERT_TRUE(read.has_value()) << read.error().message;
    ASSERT_EQ(read->size(), 1u);
    EXPECT_FALSE((*read)[0].pose);
    EXPECT_EQ((*read)[0].buttons, 3u);
    EXPECT_EQ((*read)[0].buttonsSaid, 15u);
}

TEST(DtrackParser, RandomBodiesComeOutAsTheyWereSent) {
    const unsigned seed = test::trackerSeed(1);
    TESSERA_TRACKER_SEED(seed, "DtrackParser.Random*");
    std::mt19937 random(seed);
    for (int round = 0; round < 500; ++round) {
        std::vector<SentPose> sent(random() % 20);
        std::string text = fmt::format("fr {}\n6d {}", round, sent.size());
        for (std::size_t i = 0; i < sent.size(); ++i) {
            sent[i] = test::randomPose(random);
            text += fmt::format(" [{} 1.000]", i * 3) + dtrackBlocks(sent[i], true);
        }
        const auto read = parseDtrack(bytesOf(text + "\n"));
        ASSERT_TRUE(read.has_value()) << text << read.error().message;
        ASSERT_EQ(read->size(), sent.size());
        for (std::size_t i = 0; i < sent.size(); ++i) {
            EXPECT_LT(((*read)[i].pose->position - 1000 * sent[i].position).norm(), 0.002);
            EXPECT_LT(turnBetween((*read)[i].pose->orientation, sent[i].orientation), 1e-4);
        }
    }
}

TEST(DtrackParser, RefusesWholeDatagramsInWords) {
    const std::string good = dtrackBlocks({}, true);
    const std::string mirror = "[0 0 0 0 0 0][-1 0 0 0 1 0 0 0 1]";
    for (const std::string& text :
         {std::string(), std::string("hello\n"), std::string("6d x\n"), std::string("6d -1\n"),
          "6d 2 [0 1.0]" + good + "\n", "6d 1 [0 1.0]" + good + "[\n", "6d 1 [-1 1.0]" + good + "\n",
          "6d 1 [0 1.0]" + mirror + "\n", std::string("6d 1 [0 1.0][nan nan nan 0 0 0][nan 0 0 0 1 0 0 0 1]\n"),
          std::string("6d 1000000000 \n"), std::string("6df2 1 1 [0 1.0 999999999 0][0 0 0][1 0 0 0 1 0 0 0 1][]\n")}) {
        const auto read = parseDtrack(bytesOf(text));
        ASSERT_FALSE(read.has_value()) << text;
        EXPECT_FALSE(read.error().message.empty());
    }
}

Bytes oscMessage(const std::string& address, const std::vector<double>& values, char type = 'f') {
    WireWriter out;
    out.text(address).text("," + std::string(values.size(), type));
    for (const double value : values) {
        if (type == 'f') out.f32(static_cast<float>(value));
        if (type == 'd') out.f64(value);
        if (type == 'i') out.i32(static_cast<std::int32_t>(value));
    }
    return out.bytes;
}
Bytes oscBundle(const std::vector<Bytes>& elements) {
    WireWriter out;
    out.text("#bundle").u32(0).u32(1);
    for (const Bytes& element : elements) out.u32(static_cast<std::uint32_t>(element.size())).raw(element);
    return out.bytes;
}

TEST(OscParser, ReadsEveryAddressAndNestedBundles) {
    const Bytes datagram =
        oscBundle({oscMessage("/tessera/3/pose", {1, 2, 3, 0, 0.6, 0, 0.8}),
                   oscBundle({oscMessage("/tessera/flystick/1/button", {2, 1}, 'i'),
                              oscMessage("/tessera/tool/5/axis", {1, -0.5})}),
                   oscMessage("/tessera/4/position", {4, 5, 6}, 'd'),
                   oscMessage("/tessera/4/orientation", {0, 0, 1, 0}), oscMessage("/somebody/else", {1, 2})});
    const auto read = parseOsc(datagram);
    ASSERT_TRUE(read.has_value()) << read.error().message;
    ASSERT_EQ(read->size(), 5u);
    EXPECT_EQ((*read)[0].sensor, (SensorName{SensorKind::kBody, 3}));
    EXPECT_EQ((*read)[0].pose->position, Vec3d(1, 2, 3));
    EXPECT_NEAR((*read)[0].pose->orientation.y(), 0.6, 1e-6);
    EXPECT_NEAR((*read)[0].pose->orientation.w(), 0.8, 1e-6);
    EXPECT_EQ((*read)[1].sensor, (SensorName{SensorKind::kFlystick, 1}));
    EXPECT_EQ((*read)[1].buttons, 4u);
    EXPECT_EQ((*read)[1].buttonsSaid, 4u);
    EXPECT_EQ((*read)[2].axes[1], -0.5);
    EXPECT_EQ((*read)[3].pose->position, Vec3d(4, 5, 6));
    EXPECT_FALSE((*read)[3].pose->turns);
    EXPECT_FALSE((*read)[4].pose->placed);
    EXPECT_EQ((*read)[4].pose->orientation.z(), 1);
}

TEST(OscParser, TakesBooleansAndPassesWhatIsNoNumber) {
    WireWriter out;
    out.text("/tessera/0/button").text(",isbT").i32(1).text("from a phone").u32(3).raw(bytesOf("abc")).fill(4);
    const auto read = parseOsc(out.bytes);
    ASSERT_TRUE(read.has_value()) << read.error().message;
    ASSERT_EQ(read->size(), 1u);
    EXPECT_EQ((*read)[0].buttons, 2u);
}

TEST(OscParser, RefusesWholeDatagramsInWords) {
    Bytes deep = oscMessage("/tessera/0/position", {1, 2, 3});
    for (int i = 0; i < 20; ++i) deep = oscBundle({deep});
    Bytes longer = oscBundle({oscMessage("/tessera/0/position", {1, 2, 3})});
    longer[19] = std::byte{0xff};  // the element's size
    Bytes short_ = oscMessage("/tessera/0/pose", {1, 2, 3, 0, 0, 0, 1});
    short_.resize(short_.size() - 4);
    std::vector<Bytes> many(kMostReports + 1, oscMessage("/tessera/0/position", {1, 2, 3}));
    for (const Bytes& datagram : {Bytes(), Bytes(3), bytesOf("abcd"), deep, longer, short_, oscBundle(many),
                                  oscMessage("/tessera/0/pose", {1, 2, 3}), oscMessage("/tessera/0/button", {99, 1}),
                                  oscMessage("/tessera/0/axis", {-1, 1}), oscMessage("/tessera/0/axis", {0.5, 1}),
                                  WireWriter().text("/tessera/0/pose").bytes,
                                  WireWriter().text("/tessera/0/axis").text(",b").u32(0xffffffffu).bytes}) {
        const auto read = parseOsc(datagram);
        ASSERT_FALSE(read.has_value()) << asText(datagram);
        EXPECT_FALSE(read.error().message.empty());
    }
}

/// What is taken of broken bytes is within its bounds, and what is refused has words.
TEST(Parsers, TakeNothingBeyondTheirBoundsFromMutatedBytes) {
    const unsigned seed = test::trackerSeed(2);
    TESSERA_TRACKER_SEED(seed, "Parsers.TakeNothing*");
    std::mt19937 random(seed);
    int taken = 0;
    for (int round = 0; round < 40'000; ++round) {
        const SentPose pose = test::randomPose(random);
        const bool osc = round % 2 == 0;
        const Bytes good = osc ? oscBundle({oscMessage("/tessera/1/pose", {1, 2, 3, 0, 0, 0, 1}),
                                            oscMessage("/tessera/1/button", {3, 1}, 'i')})
                               : bytesOf("fr 1\r\n6d 1 [0 1.000]" + dtrackBlocks(pose, true) +
                                         "\r\n6df2 1 1 [0 1.0 8 2]" + dtrackBlocks(pose, false) + "[3 0.1 0.2]\r\n");
        const Bytes bytes = test::mutated(good, random);
        const auto read = osc ? parseOsc(bytes) : parseDtrack(bytes);
        if (!read) {
            EXPECT_FALSE(read.error().message.empty());
            continue;
        }
        ++taken;
        EXPECT_LE(read->size(), kMostReports);
        for (const SensorReport& report : *read) {
            EXPECT_GE(report.sensor.number, 0);
            EXPECT_LE(report.sensor.number, 65535);
            EXPECT_EQ(report.buttons & ~report.buttonsSaid, 0u);
        }
    }
    EXPECT_GT(taken, 1000);
}

}  // namespace
}  // namespace tessera
