// Pictures of all tiles: who says what a tile shows.
#include "server/sim/desk/ImageRequests.h"

#include <gtest/gtest.h>

#include "common/codec/ApplicationCodec.h"
#include "tests/unit/session/ServerFixture.h"
#include "tests/unit/sim/SceneForTests.h"

namespace tessera {
namespace {

/// Hosts a and b draw a tile each.
Wall wallOfTwo() {
    Wall wall = test::wallOfOne();
    wall.screens[0].grid.columns = 2;
    wall.hosts = {{"a", {{"front", 0, 0, Eye::kCenter, "viewer"}}}, {"b", {{"front", 1, 0, Eye::kCenter, "viewer"}}}};
    return wall;
}

/// Frames may take eight seconds.
ServerSessionConfig slowFrames() {
    ServerSessionConfig config = twoHosts();
    config.sync.frameDeadline = config.sync.firstFrameDeadline = 8s;
    return config;
}

class ImageRequestsTest : public testing::Test {
protected:
    void send(const std::string& host, const std::string& tile, std::string_view picture) {
        server.take(requests.imageReceived(
            {host, message::TileImage{.request = 1, .frame = frame, .tile = tile, .picture = textBytes(picture)}}));
    }
    [[nodiscard]] std::optional<answer::Images> answer() const {
        const auto replies = server.sent<message::Reply>(application);
        if (replies.empty()) return std::nullopt;
        return std::get<answer::Images>(decodeAnswer(replies[0].body).value());
    }

    /// Both draw the frame that is open, and show it.
    void show() {
        for (const ConnectionId host : {a, b}) server.ready(host, frame);
        for (const ConnectionId host : {a, b}) server.show(host);
    }
    /// Time passes while both live and draw.
    void draw(Duration time) {
        for (const TimePoint end = server.now + time; server.now < end;) {
            server.run(100ms, {a, b, application});
            server.take(requests.advance(server.now));
        }
    }

    const Wall wall = wallOfTwo();
    ServerFixture server{slowFrames()};
    ImageRequests requests{wall, server.session, 5s};
    ConnectionId a = server.join("a"), b = server.join("b");
    ConnectionId application = server.hello("somebody", PeerRole::kApplication);
    FrameNumber frame = server.begin();
};

TEST_F(ImageRequestsTest, OfATileItsOwnHostSaysWhatItShows) {
    server.take(requests.ask({.connection = application, .request = 1}, server.now));
    send("b", "front-0-0", "a lie");
    send("b", "front-1-0", "right");
    EXPECT_FALSE(answer()) << "the picture of a is still to come";
    send("a", "front-0-0", "left");
    const auto images = answer();
    ASSERT_TRUE(images);
    EXPECT_TRUE(images->missing.empty());
    ASSERT_EQ(images->tiles.size(), 2u);
    EXPECT_EQ(images->tiles[0].host, "b");
    EXPECT_EQ(images->tiles[0].tile, "front-1-0");
    EXPECT_EQ(images->tiles[1].host, "a");
    EXPECT_EQ(asText(images->tiles[1].png), "left");
}

TEST_F(ImageRequestsTest, WhatDoesNotComeInTimeIsMissing) {
    show();
    server.take(requests.ask({.connection = application, .request = 1}, server.now));
    send("a", "front-1-0", "a lie");
    send("b", "front-1-0", "right");
    server.take(requests.advance(server.now + 5s));
    const auto images = answer();
    ASSERT_TRUE(images);
    EXPECT_EQ(images->missing, Names{"front-0-0"});
    EXPECT_EQ(images->tiles.size(), 1u);
}

TEST_F(ImageRequestsTest, FramesMayTakeSeconds) {
    server.take(requests.ask({.connection = application, .request = 1}, server.now));
    for (int i = 0; i < 2; ++i) {  // the frame before, and the one that was asked for
        draw(6s);
        EXPECT_FALSE(answer()) << "hosts draw";
        show();
        if (i == 0) frame = server.begin();
    }
    draw(4s);  // pictures are made and sent
    EXPECT_FALSE(answer());
    send("a", "front-0-0", "left");
    send("b", "front-1-0", "right");
    const auto images = answer();
    ASSERT_TRUE(images);
    EXPECT_EQ(images->missing, Names{});
}

TEST_F(ImageRequestsTest, NobodyIsWaitedForWithoutEnd) {
    server.take(requests.ask({.connection = application, .request = 1}, server.now));
    const TimePoint begun = server.now;
    while (!answer() && server.now < begun + 100s) {
        draw(1s);
        // Frames go on, but the one that was asked for is never shown by a.
        if (server.session.mayBegin(server.now)) frame = server.begin();
        server.ready(b, frame);
        server.show(b);
    }
    ASSERT_TRUE(answer());
    EXPECT_LE(server.now - begun, ImageRequests::kLongest + 1s);
    EXPECT_EQ(answer()->missing.size(), 2u);
}

TEST_F(ImageRequestsTest, AWallWithoutFramesIsNotWaitedForLongerThanOne) {
    show();
    server.take(requests.ask({.connection = application, .request = 1}, server.now));
    draw(4900ms);
    EXPECT_FALSE(answer());
    draw(200ms);
    EXPECT_TRUE(answer());
}

}  // namespace
}  // namespace tessera
