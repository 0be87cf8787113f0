/// Answers of a server where numbers and texts are beyond all that anybody means.
#include <gtest/gtest.h>

#include "common/request/Requests.h"
#include "tests/support/wall/AskedWall.h"

namespace tessera::simulation {
namespace {

TEST(Refusals, OfPathsWithZerosAreRefusals) {
    SimulatedWall wall({.scene = kYard, .wall = "1x1", .draws = false});
    const std::string zero(1, '\0');
    for (const std::string& path : {zero, "a" + zero + "b", "asset://a" + zero + "b", "/" + zero + "/"}) {
        const auto loaded = wall.application().ask(request::LoadFile{.path = path});
        ASSERT_FALSE(loaded);
        EXPECT_EQ(loaded.error().code, ErrorCode::kRefused) << loaded.error().message;
    }
}

/// Two scales that are numbers lead to a place that is none: the asker is told so of that node, and the rest of others.
TEST(Refusals, OfAPlaceThatIsBeyondAllNumbersIsOfThatNodeAlone) {
    SimulatedWall wall({.scene = R"(node { name: "near" transform {} }
                                    node { name: "outer" transform {} node { name: "inner" transform {} } })",
                        .wall = "1x1",
                        .draws = false});
    SimulatedApplication& application = wall.application();
    for (const char* path : {"/outer", "/outer/inner"}) {
        const Expected<ObjectId> node = findNode(application.scene(), path);
        ASSERT_TRUE(node);
        ASSERT_TRUE(application.ask(request::MoveNode{.node = *node, .move = {.scale = Vec3d::Constant(1e200)}}));
    }
    const auto told =
        application.ask(request::GetObjects{{.names = {"/near", "/outer/inner", "/outer"}, .places = true}});
    ASSERT_TRUE(told) << told.error().message;
    ASSERT_EQ(told->objects.size(), 3u);
    ASSERT_EQ(told->places.size(), 3u);
    EXPECT_TRUE(told->objects[0].id);
    EXPECT_FALSE(told->objects[1].id);
    EXPECT_NE(told->objects[1].path, "");
    EXPECT_TRUE(told->objects[2].id);
    EXPECT_EQ(told->places[2].xAxis.x(), 1e200);
}

}  // namespace
}  // namespace tessera::simulation
