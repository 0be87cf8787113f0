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

    const Wall wall = wallOfTwo();
    ServerFixture server;
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
    server.take(requests.ask({.connection = application, .request = 1}, server.now));
    send("a", "front-1-0", "a lie");
    send("b", "front-1-0", "right");
    server.take(requests.advance(server.now + 5s));
    const auto images = answer();
    ASSERT_TRUE(images);
    EXPECT_EQ(images->missing, Names{"front-0-0"});
    EXPECT_EQ(images->tiles.size(), 1u);
}

}  // namespace
}  // namespace tessera
