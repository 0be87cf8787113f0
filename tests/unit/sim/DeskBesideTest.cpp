// What takes longer than a frame has time for: found and made beside the frames, and answered then.
#include <gtest/gtest.h>

#include <deque>

#include <fmt/format.h>

#include "common/codec/ChangeCodec.h"
#include "common/cores/Skin.h"
#include "common/geometry/Mesh.h"
#include "common/scene/FieldTable.h"
#include "server/collision/pipeline/AsideQuery.h"
#include "tests/support/words/Words.h"
#include "tests/unit/sim/DeskStage.h"

namespace tessera {
namespace {

class DeskBeside : public test::DeskStage {
protected:
    ConnectionId join(const std::string& name) {
        const ConnectionId connection = server.hello(name, PeerRole::kApplication);
        desk.applicationJoined(connection, {.name = name});
        return connection;
    }
    void ask(ConnectionId connection, const ApplicationRequest& request) {
        server.take(desk.received({connection, "somebody", ++asked, share(encodeRequest(request))}, server.now));
    }
    /// What the threads beside do; how much that was.
    std::size_t work() {
        std::size_t done = 0;
        for (; !besides.empty(); ++done) {
            const std::function<WorkedOut()> one = std::move(besides.front());
            besides.pop_front();
            server.take(one()(server.now));
        }
        return done;
    }
    template <typename Answer>
    std::vector<Answer> answers(ConnectionId connection) {
        std::vector<Answer> all;
        for (const message::Reply& reply : server.sent<message::Reply>(connection)) {
            EXPECT_EQ(reply.error, "");
            all.push_back(std::get<Answer>(decodeAnswer(reply.body).value()));
        }
        return all;
    }
    void load(ChangeList list) {
        std::vector<ChangeList> lists;
        lists.push_back(std::move(list));
        ASSERT_TRUE(simulation.load(std::move(lists)));
    }
    /// So many nodes below one.
    void crowd(int nodes) {
        test::ListMaker make;
        const ObjectId hall = make.node("hall", kRootNode);
        for (int i = 0; i < nodes; ++i) make.node("n" + std::to_string(i), hall);
        load(make.builder.take());
    }

    std::deque<std::function<WorkedOut()>> besides;
    RequestDesk desk{around()};
    [[nodiscard]] DeskSurroundings around() {
        DeskSurroundings all = surroundings();
        all.lookBeside = [this](DeskSurroundings::Look look) {
            besides.push_back([this, look] { return look(simulation.scene(), simulation.sequence()); });
        };
        all.workBeside = [this](std::function<WorkedOut()> one) { besides.push_back(std::move(one)); };
        return all;
    }
    std::uint64_t asked = 0;
};

TEST_F(DeskBeside, NamesAmongManySiblingsAreLookedForElsewhere) {
    crowd(10'000);
    const ConnectionId one = join("one"), other = join("other");
    ask(one, request::GetObjects{{.names = {"/hall"}}});
    EXPECT_EQ(answers<answer::Objects>(one).size(), 1u) << "little is answered at once";
    for (int i = 0; i < 3; ++i) ask(one, request::GetObjects{{.names = {"/hall/n9999", "/hall/n17", "/hall/x"}}});
    ask(other, request::GetObjects{{.names = {"#3"}, .paths = true}});
    ask(one, request::FindNodes{{.expression = "/hall/n99*"}});
    EXPECT_EQ(answers<answer::Objects>(one).size(), 1u);
    EXPECT_EQ(besides.size(), 1u) << "one at a time";
    EXPECT_EQ(work(), 5u);
    const std::vector<message::Reply> replies = server.sent<message::Reply>(one);
    ASSERT_EQ(replies.size(), 5u);
    const auto told = std::get<answer::Objects>(decodeAnswer(replies[1].body).value());
    EXPECT_EQ(told.sequence, simulation.sequence());
    EXPECT_EQ(told.objects[0].path, "/hall/n9999");
    EXPECT_EQ(told.objects[0].id, findNode(simulation.scene(), "/hall/n9999").value());
    EXPECT_EQ(told.objects[2].path, findNode(simulation.scene(), "/hall/x").error().message);
    EXPECT_EQ(answers<answer::Objects>(other).at(0).objects[0].path, "/hall/n0");
    const auto found = std::get<answer::FoundPage>(decodeAnswer(replies[4].body).value());
    EXPECT_EQ(found.nodes.size(), 11u) << "of the 8,192 that a page looks at";
    EXPECT_EQ(found.nodes[1].path, "/hall/n990");
}

TEST_F(DeskBeside, PlansOfManyTilesAreMadeElsewhere) {
    const ConnectionId one = join("one");
    ask(one, request::GetWall{});
    EXPECT_EQ(answers<answer::WallPlan>(one).size(), 1u) << "little is answered at once";
    wall.screens[0].grid.columns = 32;
    wall.screens[0].grid.rows = 16;
    wall.hosts[0].tiles.clear();
    for (int column = 0; column < 32; ++column)
        for (int row = 0; row < 16; ++row)
            wall.hosts[0].tiles.push_back({.screen = "front", .column = column, .row = row, .user = "viewer"});
    ask(one, request::GetWall{});
    EXPECT_EQ(answers<answer::WallPlan>(one).size(), 1u);
    EXPECT_EQ(work(), 1u);
    ASSERT_EQ(answers<answer::WallPlan>(one).size(), 2u);
    EXPECT_EQ(answers<answer::WallPlan>(one)[1].tiles.size(), 512u);
}

TEST_F(DeskBeside, WhatHasMuchToTellIsToldByAnotherThread) {
    test::ListMaker make;
    std::vector<ObjectId> bones;
    for (int i = 0; i < 6'000; ++i) bones.push_back(make.node("bone", kRootNode));
    const ObjectId skin = make.create<Skin>();
    make.builder.set(skin, typeOf<Skin>(), fieldId<&Skin::joints>, bones);
    make.node("skin", kRootNode, skin);
    load(make.builder.take());
    const ConnectionId one = join("one");
    const ObjectId node = findNode(simulation.scene(), "/skin").value();
    ask(one, request::GetObjects{{.names = {fmt::format("#{}", node.value)}, .paths = false, .content = true}});
    ask(one, request::GetTree{{.node = node}});
    EXPECT_TRUE(server.sent<message::Reply>(one).empty());
    EXPECT_EQ(work(), 2u);
    const std::vector<message::Reply> replies = server.sent<message::Reply>(one);
    ASSERT_EQ(replies.size(), 2u);
    EXPECT_GT(std::get<answer::Objects>(decodeAnswer(replies[0].body).value()).content.size(), 6'000u);
    EXPECT_GT(std::get<answer::TreePage>(decodeAnswer(replies[1].body).value()).content.size(), 6'000u);
}

TEST_F(DeskBeside, ApplicationsTakeTurnsAndWhoAsksForTooMuchIsRefused) {
    crowd(10'000);
    const ConnectionId greedy = join("greedy"), other = join("other");
    for (std::size_t i = 0; i < BesideRequests::kMostOfOne + 10; ++i)
        ask(greedy, request::GetObjects{{.names = {"/hall/n1"}}});
    const std::vector<message::Reply> refused = server.sent<message::Reply>(greedy);
    ASSERT_EQ(refused.size(), 9u) << "one is at work, the others wait";
    EXPECT_EQ(refused[0].code, ErrorCode::kLimit);
    ask(other, request::GetObjects{{.names = {"/hall/n1"}}});
    for (int i = 0; i < 2; ++i) {
        const std::function<WorkedOut()> one = std::move(besides.front());
        besides.pop_front();
        server.take(one()(server.now));
    }
    EXPECT_EQ(answers<answer::Objects>(other).size(), 1u) << "after one of the greedy";
    // Who leaves waits for nothing, and what is at work is told to nobody.
    server.drop(greedy);
    desk.applicationLeft(greedy);
    EXPECT_EQ(work(), 1u);
    const std::vector<std::string> large(256, std::string(4'000, 'x'));
    for (int i = 0; i < 8; ++i) ask(other, request::GetObjects{{.names = large}});
    EXPECT_LE(besides.size(), 1u);
}

TEST_F(DeskBeside, LargeGeometryIsMadeReadyElsewhereBeforeItIsPicked) {
    test::ListMaker make;
    make.node("wall", kRootNode, make.sheet(64));
    make.node("box", make.node("place", kRootNode, make.transform(Vec3d(10.2, 10.1, 5))), make.box(Vec3d::Ones()));
    load(make.builder.take());
    const ConnectionId one = join("one");
    const auto at = [](double x) { return request::PickAt{{.ray = Ray{Vec3d(x, 10.1, 20), -Vec3d::UnitZ()}}}; };
    ask(one, at(10.2));
    ASSERT_EQ(answers<answer::Picked>(one).size(), 1u) << "the wall lies behind the box, and matters to nobody";
    EXPECT_EQ(answers<answer::Picked>(one)[0].node, findNode(simulation.scene(), "/place/box").value());
    ask(one, at(20.3));
    EXPECT_EQ(server.sent<message::Reply>(one).size(), 1u);
    EXPECT_EQ(besides.size(), 1u);
    work();
    ASSERT_EQ(answers<answer::Picked>(one).size(), 2u);
    EXPECT_EQ(answers<answer::Picked>(one)[1].node, findNode(simulation.scene(), "/wall").value());
    ask(one, at(20.4));
    ASSERT_EQ(answers<answer::Picked>(one).size(), 3u) << "now at once";
    ask(one, request::MeasureDistance{.from = Vec3d(30, 30, 7), .node = kRootNode});
    EXPECT_EQ(work(), 0u);
    const message::Reply measured = server.sent<message::Reply>(one).at(3);
    EXPECT_DOUBLE_EQ(std::get<answer::Measured>(decodeAnswer(measured.body).value()).distance, 7);
}

TEST_F(DeskBeside, SoIsWhatIsMeasured) {
    test::ListMaker make;
    std::vector<float> places(3 * 1000);
    for (std::size_t i = 0; i < places.size(); i += 3) places[i] = static_cast<float>(i);
    const ObjectId points = make.create<Geometry>();
    setField<&Geometry::positions>(make.builder, points, Blob::of(std::span<const float>(places)));
    make.builder.set(points, typeOf<Geometry>(), fieldId<&Geometry::primitive>, toValue(Geometry::kPoints));
    setField<&Geometry::pointRadius>(make.builder, points, 0.5);
    make.node("points", kRootNode, points);
    load(make.builder.take());
    const ConnectionId one = join("one");
    ask(one, request::MeasureDistance{.from = Vec3d(0, 2, 0), .node = kRootNode});
    EXPECT_TRUE(server.sent<message::Reply>(one).empty());
    EXPECT_EQ(besides.size(), 1u);
    work();
    const auto replies = server.sent<message::Reply>(one);
    ASSERT_EQ(replies.size(), 1u);
    EXPECT_DOUBLE_EQ(std::get<answer::Measured>(decodeAnswer(replies[0].body).value()).distance, 1.5);
}

TEST_F(DeskBeside, WhatChangesMeanwhileIsToldAsItWasWhenItWasAsked) {
    test::ListMaker make;
    const ObjectId shape = make.sheet(64);
    make.node("wall", kRootNode, shape);
    load(make.builder.take());
    const ConnectionId one = join("one"), other = join("other");
    const request::PickAt wish{{.ray = Ray{Vec3d(20.3, 10.1, 20), -Vec3d::UnitZ()}}};
    for (int i = 0; i < 8; ++i) ask(one, wish);
    ask(other, wish);
    // The sheet is another one while the first answer is under way.
    const Aspect& scene = simulation.scene();
    const ObjectId at = scene.get<Node>(findNode(scene, "/wall").value())->core;
    const std::span<const float> flat = scene.get<Geometry>(at)->positions.as<float>();
    std::vector<float> raised(flat.begin(), flat.end());
    for (std::size_t i = 2; i < raised.size(); i += 3) raised[i] = 3;
    ChangeListBuilder change;
    setField<&Geometry::positions>(change, at, Blob::of(std::span<const float>(raised)));
    (void)simulation.step(true, {Edit{.list = change.take()}});
    work();
    EXPECT_EQ(answers<answer::Picked>(one)[0].point.z(), 0) << "as it was when it was asked";
    EXPECT_EQ(answers<answer::Picked>(one)[1].point.z(), 3);
    EXPECT_EQ(answers<answer::Picked>(one).size(), 8u);
    EXPECT_EQ(answers<answer::Picked>(other).size(), 1u);
    ask(one, wish);
    EXPECT_EQ(answers<answer::Picked>(one).size(), 9u) << "at once: it is there";
}

TEST_F(DeskBeside, TooMuchOnOneWayIsRefused) {
    test::ListMaker make;
    const ObjectId box = make.box(Vec3d::Ones());
    const ObjectId place = make.node("place", kRootNode, make.transform(Vec3d(0, 9, 0)));
    for (std::size_t i = 0; i <= AsideQuery::kMostThings; ++i) make.node("", place, box);
    load(make.builder.take());
    const ConnectionId one = join("one");
    ask(one, request::MeasureDistance{.from = Vec3d(0, 8, 0), .node = kRootNode});
    ask(one, request::PickAt{{.ray = Ray{Vec3d(0.4, 8, 0.6), Vec3d::UnitY()}}});
    work();
    const auto replies = server.sent<message::Reply>(one);
    ASSERT_EQ(replies.size(), 2u);
    EXPECT_TRUE(replies[0].error.empty()) << "no box is met: at once. " << replies[0].error;
    EXPECT_EQ(replies[1].code, ErrorCode::kLimit) << replies[1].error;
}

TEST_F(DeskBeside, ReferencesCountAsChangesDo) {
    test::ListMaker make;
    std::vector<ObjectId> bones;
    for (int i = 0; i < 50'000; ++i) bones.push_back(ObjectId(static_cast<std::uint64_t>(i) + 10));
    for (int i = 0; i < 10; ++i) make.builder.set(make.create<Skin>(), typeOf<Skin>(), fieldId<&Skin::joints>, bones);
    const ConnectionId one = join("one");
    ask(one, request::ProposeChanges{.list = share(encodeChangeList(make.builder.take()))});
    const auto replies = server.sent<message::Reply>(one);
    ASSERT_EQ(replies.size(), 1u);
    EXPECT_EQ(replies[0].code, ErrorCode::kLimit);
    EXPECT_WORDS(replies[0].error);
}

}  // namespace
}  // namespace tessera
