// What an application is told of the wall itself: how its hosts are, who is there, and what undo would do.
#include <gtest/gtest.h>

#include "common/scene/Edits.h"
#include "common/scene/FieldTable.h"
#include "server/sim/frame/LoadParts.h"
#include "tests/unit/sim/DeskStage.h"
#include "tests/unit/sim/SingleEdits.h"

namespace tessera {
namespace {

using test::one;

class DeskNews : public test::DeskStage {
protected:
    ConnectionId join(const std::string& name, const Entrant& who = {.role = Role::kViewer}) {
        const ConnectionId connection = server.hello(name, PeerRole::kApplication);
        desk.applicationJoined(connection, {.name = name, .who = who, .since = server.now});
        return connection;
    }
    void ask(ConnectionId connection, const ApplicationRequest& request) {
        server.take(desk.received({connection, "somebody", ++asked, share(encodeRequest(request))}, server.now));
    }
    template <typename Answer>
    Answer asks(ConnectionId connection, const ApplicationRequest& request) {
        ask(connection, request);
        return std::get<Answer>(decodeAnswer(server.sent<message::Reply>(connection).back().body).value());
    }
    /// What somebody has been told of states, each time.
    std::vector<notice::States> told(ConnectionId connection) {
        std::vector<notice::States> all;
        for (const message::Notice& one : server.sent<message::Notice>(connection))
            all.push_back(std::get<notice::States>(decodeNotice(one.body).value()));
        return all;
    }
    void pass(std::chrono::milliseconds time) {
        for (const TimePoint until = server.now + time; server.now < until; server.now += std::chrono::milliseconds(10))
            server.take(desk.advance(server.now));
    }
    std::optional<Error> trouble;
    RequestDesk desk{[this] {
        DeskSurroundings all = surroundings();
        all.editsRefused = [this] { return trouble; };
        return all;
    }()};
    std::uint64_t asked = 0;
};

TEST_F(DeskNews, StatesAreToldAtOnceAndThenWhenTheyAreOthers) {
    const ConnectionId one = join("one"), other = join("other");
    EXPECT_EQ(desk.nextDeadline(), TimePoint::max()) << "nobody looks where nobody wants to know";
    ask(one, request::SubscribeNews{{.states = true}});
    pass(500ms);
    ASSERT_EQ(told(one).size(), 1u);
    EXPECT_EQ(told(one)[0].applications, 2u);
    ASSERT_EQ(told(one)[0].hosts.size(), 2u);
    EXPECT_EQ(told(one)[0].hosts[0].state, "absent");
    EXPECT_TRUE(told(other).empty());

    trouble = Error{ErrorCode::kFailed, "the disk is full"};
    pass(100ms);
    ASSERT_EQ(told(one).size(), 2u);
    EXPECT_EQ(told(one)[1].journalTrouble, "the disk is full");
    ask(other, request::SubscribeNews{{.states = true}});
    pass(500ms);
    EXPECT_EQ(told(one).size(), 2u) << "who comes to know it is told alone";
    ASSERT_EQ(told(other).size(), 1u);
    EXPECT_EQ(told(other)[0].journalTrouble, "the disk is full");

    trouble.reset();
    (void)server.hello("a");
    pass(100ms);
    ASSERT_EQ(told(one).size(), 3u);
    EXPECT_NE(told(one)[2].hosts[0].state, "absent");
    EXPECT_EQ(told(one)[2].journalTrouble, "");
    desk.applicationLeft(other);
    pass(100ms);
    ASSERT_EQ(told(one).size(), 4u);
    EXPECT_EQ(told(one)[3].applications, 1u);
    EXPECT_GT(told(one)[3].comings, told(one)[2].comings);
    ask(one, request::SubscribeNews{});
    trouble = Error{ErrorCode::kFailed, "again"};
    pass(500ms);
    EXPECT_EQ(told(one).size(), 4u);
    EXPECT_EQ(desk.nextDeadline(), TimePoint::max());
}

TEST_F(DeskNews, ACrowdThatComesAndGoesIsTwentyWordsASecond) {
    const ConnectionId one = join("one");
    ask(one, request::SubscribeNews{{.states = true}});
    for (int i = 0; i < 100; ++i) {
        desk.applicationLeft(join("crowd"));
        pass(10ms);
    }
    EXPECT_LE(told(one).size(), 22u);
    EXPECT_GE(told(one).size(), 15u);
}

TEST_F(DeskNews, PeopleHaveTheNamesThatTheyHaveProved) {
    const ConnectionId ada = join("console", {.role = Role::kEditor, .by = Entrant::By::kKey, .name = "ada"});
    server.now += 2s;
    join("tessera-ctl");
    const auto told = asks<answer::People>(ada, request::GetPeople{});
    ASSERT_EQ(told.people.size(), 2u);
    EXPECT_EQ(told.people[0].name, "ada");
    EXPECT_EQ(told.people[0].program, "console");
    EXPECT_EQ(told.people[0].role, Role::kEditor);
    EXPECT_TRUE(told.people[0].you);
    EXPECT_DOUBLE_EQ(told.people[0].seconds, 2);
    EXPECT_EQ(told.people[1].name, "");
    EXPECT_EQ(told.people[1].program, "tessera-ctl");
    EXPECT_FALSE(told.people[1].you);
    EXPECT_EQ(told.leftOut, 0u);
}

TEST_F(DeskNews, MorePeopleThanAnAnswerHoldsAreCounted) {
    const std::size_t most = ApplicationLimits().maxPeople;
    const ConnectionId first = join("first");
    for (std::size_t i = 0; i < most; ++i)
        desk.applicationJoined(ConnectionId{100'000 + i}, {.name = "crowd", .since = server.now});
    const auto told = asks<answer::People>(first, request::GetPeople{});
    EXPECT_EQ(told.people.size(), most);
    EXPECT_EQ(told.leftOut, 1u);
}

/// A scene with two boxes, and one who asks what undo would do.
class DeskSteps : public DeskNews {
protected:
    void SetUp() override {
        ChangeListBuilder list;
        for (std::uint64_t i : {1, 2}) {
            const ObjectId box{kFirstPlaceholder + 2 * i}, core{kFirstPlaceholder + 2 * i + 1};
            list.create(box, typeOf<Node>());
            list.create(core, typeOf<Transform>());
            list.place(box, kRootNode);
            setField<&Node::name>(list, box, i == 1 ? "box" : "shelf");
            setField<&Node::core>(list, box, core);
        }
        ASSERT_TRUE(simulation.load({list.take()}));
        (void)simulation.step(true, {});
        asker = join("one");
    }
    void edit(ChangeList list) { (void)simulation.step(false, one(std::move(list))); }
    void step(Edit::Kind kind) { (void)simulation.step(false, one(kind)); }
    answer::Steps steps() { return asks<answer::Steps>(asker, request::GetSteps{}); }
    ObjectId node(std::string_view path) const { return findNode(simulation.scene(), path).value(); }

    ConnectionId asker;
};

TEST_F(DeskSteps, NothingIsSaidWhereThereIsNone) {
    EXPECT_EQ(steps().undo, answer::StepPlan());
    EXPECT_EQ(steps().redo, answer::StepPlan());
}

TEST_F(DeskSteps, AFieldIsNamedWithItsNode) {
    edit(test::moveTo(test::transformAt(simulation.scene(), "/box"), Vec3d(0, 0, 5)));
    const answer::Steps first = steps();
    EXPECT_EQ(first.undo.what, "sets Transform.translation of /box");
    ASSERT_EQ(first.undo.objects.size(), 1u);
    EXPECT_EQ(first.undo.objects[0], test::transformAt(simulation.scene(), "/box"));
    EXPECT_EQ(first.undo.changes, 1u);
    EXPECT_EQ(first.sequence, simulation.sequence());
    step(Edit::Kind::kUndo);
    EXPECT_EQ(steps().undo.what, "");
    EXPECT_EQ(steps().redo.what, "sets Transform.translation of /box");
}

TEST_F(DeskSteps, WhatComesBackAndWhatGoesHaveTheirNames) {
    edit(removalList(simulation.scene(), node("/box"), 1000).value());
    EXPECT_EQ(steps().undo.what, "brings 1 node: box");
    step(Edit::Kind::kUndo);
    EXPECT_EQ(steps().redo.what, "removes /box");
    ChangeListBuilder list;
    list.place(node("/box"), node("/shelf"));
    edit(list.take());
    EXPECT_EQ(steps().undo.what, "puts /shelf/box elsewhere in the tree");
}

TEST_F(DeskSteps, OfManyTheFirstAreNamedAndTheOthersCounted) {
    ChangeListBuilder made;
    for (std::uint64_t i = 0; i < 1000; ++i) {
        const ObjectId id{kFirstPlaceholder + i};
        made.create(id, typeOf<Node>());
        made.place(id, kRootNode);
        setField<&Node::name>(made, id, "n" + std::to_string(i));
    }
    edit(made.take());
    EXPECT_EQ(steps().undo.what, "removes /n0, /n1 and more");
    ChangeListBuilder renamed;
    for (const char* path : {"/n3", "/n4", "/n5", "/n6", "/n7"}) setField<&Node::name>(renamed, node(path), "other");
    edit(renamed.take());
    EXPECT_EQ(steps().undo.what, "sets Node.name of /other[0], /other[1] and 3 more");
}

/// A load of many parts: the first lists of its undo hide what is at the end of the file, and those of its redo make
/// what is not to be seen yet.
TEST_F(DeskSteps, OfALoadInPartsTheTopIsNamed) {
    ChangeListBuilder made;
    constexpr std::uint64_t kCount = 3000;
    for (std::uint64_t i = 0; i < kCount; ++i) {
        const ObjectId id{kFirstPlaceholder + i};
        made.create(id, typeOf<Node>());
        made.place(id, i == 0 ? kRootNode : ObjectId{kFirstPlaceholder + (i < 50 ? 0 : i / 50)});
        setField<&Node::name>(made, id, i == 0 ? "hall" : "b");
    }
    std::vector<ChangeList> parts = cutForFrames(made.take(), {.changes = 100, .bytes = 4096, .seen = 100});
    ASSERT_GT(parts.size(), 40u);
    for (std::size_t i = 0; i < parts.size(); ++i) {
        Edit part{.ticket = 7, .list = std::move(parts[i]), .objects = kCount};
        part.kind = i + 1 == parts.size() ? Edit::Kind::kLastPart : Edit::Kind::kPart;
        ASSERT_TRUE(simulation.step(false, one(std::move(part))).outcomes.at(0).result);
    }
    const ObjectId hall = node("/hall");
    EXPECT_EQ(steps().undo.what, "removes /hall and more");
    EXPECT_EQ(steps().undo.objects, std::vector{hall});
    EXPECT_GT(steps().undo.changes, kCount);
    step(Edit::Kind::kUndo);
    ASSERT_TRUE(simulation.stepUnderWay());
    while (findNode(simulation.scene(), "/hall")) (void)simulation.step(false, {});
    ASSERT_TRUE(simulation.stepUnderWay()) << "nobody sees it, and it is not gone yet";
    EXPECT_EQ(steps().redo.what, "brings 3000 objects: hall") << "an undo is answered then";
    for (int i = 0; i < 1000 && simulation.stepUnderWay(); ++i) (void)simulation.step(false, {});
    EXPECT_EQ(steps().undo.what, "");
    EXPECT_EQ(steps().redo.what, "brings 3000 objects: hall");
    EXPECT_EQ(steps().redo.objects, std::vector{hall});
}

TEST_F(DeskSteps, NamesOfAnyLengthAreTold) {
    ChangeListBuilder made;
    const std::string name = "the end of " + std::string(4000, 'a');
    for (std::uint64_t i = 0; i < 100; ++i) {
        made.create(ObjectId{kFirstPlaceholder + i}, typeOf<Node>());
        made.place(ObjectId{kFirstPlaceholder + i}, i == 0 ? kRootNode : ObjectId{kFirstPlaceholder + i - 1});
        setField<&Node::name>(made, ObjectId{kFirstPlaceholder + i}, name);
    }
    edit(made.take());
    EXPECT_TRUE(steps().undo.what.starts_with("removes …aaa")) << steps().undo.what;
    EXPECT_TRUE(steps().undo.what.find(", #") != std::string::npos) << "its path would be long";
    EXPECT_LT(steps().undo.what.size(), 600u);
    step(Edit::Kind::kUndo);
    EXPECT_LT(steps().redo.what.size(), ApplicationLimits().maxTextBytes);
    ChangeListBuilder renamed;
    setField<&Node::name>(renamed, node("/box"), std::string(2000, 'b'));
    setField<&Node::name>(renamed, node("/shelf"), std::string(4000, 'c'));
    edit(renamed.take());
    EXPECT_TRUE(steps().undo.what.starts_with("sets Node.name of …bbb")) << steps().undo.what;
    EXPECT_LT(steps().undo.what.size(), 600u);
}

}  // namespace
}  // namespace tessera
