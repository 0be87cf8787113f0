// What the audit log is told of requests: names of what is written, and who did it though it has gone.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include "common/codec/ChangeCodec.h"
#include "common/scene/FieldTable.h"
#include "tests/support/words/Words.h"
#include "tests/unit/sim/DeskStage.h"

namespace tessera {
namespace {

class DeskAudit : public test::DeskStage {
protected:
    DeskAudit() {
        test::ListMaker maker;
        hall = maker.node("hall", kRootNode);
        crane = maker.node("crane", hall, maker.transform(Vec3d(1, 0, 0)));
        std::vector<ChangeList> lists;
        lists.push_back(maker.builder.take());
        EXPECT_TRUE(simulation.load(std::move(lists)));
        for (const ObjectId id : simulation.scene().ids())
            if (const Node* node = simulation.scene().get<Node>(id)) {
                if (node->name == "hall") hall = id;
                if (node->name == "crane") crane = id, transform = node->core;
            }
        ada = server.hello("somebody", PeerRole::kApplication);
        desk.applicationJoined(ada, {.name = "blender", .who = {Role::kEditor, Entrant::By::kKey, "ada"}},
                               "10.0.0.7:1");
    }
    [[nodiscard]] DeskSurroundings audited() {
        DeskSurroundings all = surroundings();
        all.audit = &book;
        return all;
    }
    void say(const ApplicationRequest& request) {
        (void)desk.received({ada, "somebody", ++asked, share(encodeRequest(request))}, server.now);
    }
    void frame() { (void)desk.committed(simulation.step(false, desk.takeEdits()), FrameNumber(++frames), {}); }
    std::vector<AuditLine> lines() {
        (void)desk.advance(TimePoint::max());
        return std::exchange(written, {});
    }
    static request::ProposeChanges proposal(const ChangeList& list) {
        return {.list = share(encodeChangeList(list)), .blobs = {}};
    }

    std::vector<AuditLine> written;
    AuditBook book{[this](std::vector<AuditLine> more) { std::ranges::move(more, std::back_inserter(written)); }};
    RequestDesk desk{audited()};
    ObjectId hall, crane, transform;
    ConnectionId ada;
    std::uint64_t asked = 0, frames = 0;
};

TEST_F(DeskAudit, NamesTheNodeWhoseTransformIsWritten) {
    ChangeListBuilder list;
    setField<&Transform::translation>(list, transform, Vec3d(2, 0, 0));
    say(proposal(list.take()));
    frame();
    const auto told = lines();
    ASSERT_EQ(told.size(), 1u);
    EXPECT_EQ(told[0].did, "ProposeChanges");
    EXPECT_EQ(told[0].objects, std::vector<std::string>{"/hall/crane"});
    EXPECT_EQ(told[0].changes, 1u);
    EXPECT_EQ(told[0].who.name, "ada");
    EXPECT_EQ(told[0].from, "10.0.0.7:1");
}

TEST_F(DeskAudit, NamesWhatIsMadeMovedRemovedAndTakenBack) {
    test::ListMaker maker;
    maker.node("lamp", hall);
    say(proposal(maker.builder.take()));
    frame();
    ASSERT_EQ(written.size(), 0u) << "together, once a second";
    say(request::MoveNode{.node = crane, .move = {.translation = Vec3d(0, 1, 0), .relative = true}});
    frame();
    say(request::RemoveNode{.node = crane});
    frame();
    say(request::UndoStep{});
    frame();
    std::map<std::string, std::vector<std::string>> by;
    for (const AuditLine& line : lines()) by[line.did] = line.objects;
    EXPECT_EQ(by.at("ProposeChanges"), std::vector<std::string>{"/hall/lamp"});
    EXPECT_EQ(by.at("MoveNode"), std::vector<std::string>{"/hall/crane"});
    EXPECT_EQ(by.at("RemoveNode"), std::vector<std::string>{"/hall/crane"});
    ASSERT_FALSE(by.at("UndoStep").empty());
    EXPECT_EQ(simulation.scene().get<Node>(crane)->name, "crane") << "it is back";
}

TEST_F(DeskAudit, WhatDoesNotHappenIsNotSaid) {
    say(request::RemoveNode{.node = ObjectId(999)});
    say(request::GetStatus{});
    say(request::UndoStep{});  // nothing to undo
    frame();
    EXPECT_TRUE(lines().empty());
    say(request::ShowPicture{});
    const auto told = lines();
    ASSERT_EQ(told.size(), 1u);
    EXPECT_WORDS(told[0].refused);
}

/// Nobody hides a deed behind another answer of the same number, or claims one.
TEST_F(DeskAudit, ANumberThatIsSaidTwiceHidesNothing) {
    const auto sayAs = [&](std::uint64_t number, const ApplicationRequest& request) {
        (void)desk.received({ada, "somebody", number, share(encodeRequest(request))}, server.now);
    };
    sayAs(5, request::MoveNode{.node = crane, .move = {.translation = Vec3d(0, 1, 0), .relative = true}});
    sayAs(5, request::RemoveNode{.node = ObjectId(999)});
    sayAs(5, request::GetTree{{.node = ObjectId(999)}});
    frame();
    sayAs(6, request::RemoveNode{.node = ObjectId(998)});
    sayAs(6, request::WhoAmI{});
    const auto told = lines();
    ASSERT_EQ(told.size(), 1u);
    EXPECT_EQ(told[0].did, "MoveNode");
}

TEST_F(DeskAudit, WhoHasGoneDidIt) {
    say(request::RemoveNode{.node = crane});
    desk.applicationLeft(ada);
    frame();
    const auto told = lines();
    ASSERT_EQ(told.size(), 1u);
    EXPECT_EQ(told[0].who.name, "ada");
    EXPECT_EQ(told[0].objects, std::vector<std::string>{"/hall/crane"});
}

TEST_F(DeskAudit, AmongManySiblingsNumbersStandForNames) {
    test::ListMaker maker;
    for (int i = 0; i < 5'000; ++i) maker.node(fmt::format("n{}", i), hall);
    say(proposal(maker.builder.take()));
    frame();
    say(request::RemoveNode{.node = crane});
    frame();
    for (const AuditLine& line : lines())
        if (line.did == "RemoveNode")
            EXPECT_EQ(line.objects, std::vector<std::string>{fmt::format("#{}", crane.value)});
}

}  // namespace
}  // namespace tessera
