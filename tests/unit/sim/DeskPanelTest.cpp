// Whose token is of a panel: what of all requests it may say.
#include <gtest/gtest.h>

#include "common/codec/ChangeCodec.h"
#include "common/cores/Switch.h"
#include "common/request/Catalogue.h"
#include "common/scene/FieldTable.h"
#include "server/sim/desk/PanelStates.h"
#include "tests/support/words/Words.h"
#include "tests/unit/sim/DeskStage.h"

namespace tessera {
namespace {

class DeskPanel : public test::DeskStage {
protected:
    DeskPanel() {
        std::vector<ChangeList> lists{test::craneScene()};
        EXPECT_TRUE(simulation.load(std::move(lists)));
        visitor = server.hello("tablet", PeerRole::kApplication);
        desk.applicationJoined(visitor, {.name = "tablet", .who = {.role = Role::kEditor, .panel = "p"}}, "", &text);
    }
    /// What it is told at once; empty: nothing yet, or that it is done.
    std::string said(const ApplicationRequest& request) {
        server.forget();
        server.take(desk.received({visitor, "tablet", ++asked, share(encodeRequest(request))}, server.now));
        const auto replies = server.sent<message::Reply>(visitor);
        return replies.empty() ? "" : replies[0].error;
    }
    std::string proposes(const ChangeList& list) {
        return said(request::ProposeChanges{.list = share(encodeChangeList(list)), .blobs = {}});
    }
    [[nodiscard]] ObjectId coreOf(std::string_view path) const {
        return simulation.scene().get<Node>(findNode(simulation.scene(), path).value_or(ObjectId()))->core;
    }
    template <typename Request, typename... More>
    void eachOf(std::variant<Request, More...>*) {
        Request request;
        if constexpr (std::is_same_v<Request, request::ProposeChanges>) request.list = share(encodeChangeList({}));
        const std::string why = said(request);
        const bool refused = why.find("panel") != why.npos || why.find("this link is of an editor") != why.npos;
        if (!Request::kInfo.forPanels) EXPECT_TRUE(refused) << Request::kInfo.name;
        sayable += !refused;
        if constexpr (sizeof...(More) > 0) eachOf(static_cast<std::variant<More...>*>(nullptr));
    }

    const std::string text = R"(title: "Crane"
controls { label: "near" node: "/crane" field: "translation" choice { options { value: "0 0 0" } } }
controls { label: "home" press { home: true } }
controls { label: "there" press { bookmark: 3 } })";
    RequestDesk desk{surroundings()};
    ConnectionId visitor;
    std::uint64_t asked = 0;
    std::size_t sayable = 0;
};

TEST_F(DeskPanel, OfAllRequestsItSaysThoseThatAPanelNeeds) {
    eachOf(static_cast<ApplicationRequest*>(nullptr));
    EXPECT_LE(sayable, 5u);
    EXPECT_GT(sayable, 0u);
}

TEST_F(DeskPanel, EditsReachItsFieldsAlone) {
    ChangeListBuilder list;
    setField<&Transform::translation>(list, coreOf("/crane"), Vec3d::Zero());
    EXPECT_EQ(proposes(list.take()), "");
    setField<&Transform::translation>(list, coreOf("/crane"), Vec3d(1, 0, 0));
    EXPECT_WORDS(proposes(list.take()));
    setField<&Transform::translation>(list, coreOf("/wall"), Vec3d::Zero());
    EXPECT_WORDS(proposes(list.take()));
    EXPECT_WORDS(said(request::ProposeChanges{.list = share(encodeChangeList({})), .blobs = {share(Bytes(8))}}));
}

TEST_F(DeskPanel, ItAsksForItsNodesAlone) {
    EXPECT_EQ(said(request::GetObjects{{.names = {"/crane"}, .content = true}}), "");
    const ObjectId crane = *findNode(simulation.scene(), "/crane"), core = coreOf("/crane");
    for (const ObjectId known : {crane, core})
        EXPECT_EQ(said(request::GetObjects{{.names = {"#" + std::to_string(known.value)}}}), "");
    EXPECT_NE(said(request::GetObjects{{.names = {"#" + std::to_string(coreOf("/wall").value)}}}), "");
    for (const char* other : {"/wall", "#1", "", "/crane/hook", "/crane[0]", "#", "#x", "#99999"})
        EXPECT_WORDS(said(request::GetObjects{{.names = {"/crane", other}}}));
}

TEST_F(DeskPanel, WhatStandsBesideAMissingNodeIsNotTold) {
    ChangeListBuilder list;
    setField<&Node::name>(list, *findNode(simulation.scene(), "/crane"), "lift");
    (void)simulation.step(true, {{.ticket = 1, .list = list.take()}});
    const std::string why = said(request::GetObjects{{.names = {"/crane"}}});
    EXPECT_WORDS(why);
    EXPECT_EQ(why.find("lift"), std::string::npos) << why;
}

TEST_F(DeskPanel, TheViewGoesWhereItSaysAlone) {
    using Deed = NavigationWish::Deed;
    const auto flies = [&](const NavigationWish& wish) { return said(request::NavigateView{wish}); };
    const std::string no = flies({.deed = Deed::kGoToBookmark, .bookmark = 4});
    EXPECT_WORDS(no);
    EXPECT_NE(flies({.deed = Deed::kHome}), no);
    EXPECT_NE(flies({.deed = Deed::kGoToBookmark, .bookmark = 3}), no);
    EXPECT_EQ(flies({.deed = Deed::kKeepBookmark, .bookmark = 3}), no);
    EXPECT_EQ(flies({.deed = Deed::kFit}), no);
    EXPECT_EQ(flies({.mode = NavigationMode::kWalk, .deed = Deed::kHome}), no);
    EXPECT_EQ(flies({.deed = Deed::kHome, .input = InputState()}), no);
}

TEST_F(DeskPanel, ItIsToldAsItStandsAndOnceAlone) {
    const auto asks = [&](const std::string& since) {
        EXPECT_EQ(said(request::GetPanel{since}), "");
        const auto replies = server.sent<message::Reply>(visitor);
        const Expected<ApplicationAnswer> answer = decodeAnswer(replies.at(0).body);
        return answer ? std::get<answer::PanelState>(*answer) : answer::PanelState();
    };
    const answer::PanelState state = asks("");
    EXPECT_FALSE(state.same);
    EXPECT_EQ(state.title, "Crane");
    ASSERT_EQ(state.controls.size(), 3u);
    const PanelControlState& near = state.controls[0];
    EXPECT_EQ(near.kind, PanelKind::kChoice);
    EXPECT_EQ(near.fault, "");
    EXPECT_EQ(near.now.object, coreOf("/crane"));
    EXPECT_EQ(near.now.numbers, (std::vector<double>{0, 0, 0}));
    EXPECT_EQ(near.options.at(0).label, "0 0 0") << "an option without a label is called by its value";
    EXPECT_EQ(near.options.at(0).gives.numbers, near.now.numbers);
    EXPECT_EQ(state.controls[1].kind, PanelKind::kPress);
    EXPECT_TRUE(state.controls[1].home);
    EXPECT_EQ(state.controls[2].bookmark, 3u);

    const answer::PanelState again = asks(state.stamp);
    EXPECT_TRUE(again.same);
    EXPECT_TRUE(again.controls.empty());
    std::vector<Edit> edits{{.ticket = 1, .list = test::moveTo(coreOf("/crane"), Vec3d(1, 2, 3))}};
    (void)simulation.step(true, std::move(edits));
    const Vec3d place = test::placeOf(simulation.scene(), "/crane");
    const answer::PanelState other = asks(state.stamp);
    EXPECT_FALSE(other.same);
    EXPECT_NE(other.stamp, state.stamp);
    EXPECT_EQ(other.controls.at(0).now.numbers, (std::vector<double>{place.x(), place.y(), place.z()}));
    EXPECT_NE(place, Vec3d(Vec3d::Zero()));
    EXPECT_FALSE(asks("nonsense").same);
}

TEST_F(DeskPanel, WhoseTokenIsOfNoneHasNoneToAskFor) {
    const ConnectionId other = server.hello("other", PeerRole::kApplication);
    desk.applicationJoined(other, {.name = "o", .who = {.role = Role::kOperator}}, "");
    visitor = other;
    EXPECT_WORDS(said(request::GetPanel{}));
}

TEST(PanelStates, SlidersOfWholeNumbersHaveWholeSteps) {
    test::ListMaker make;
    const ObjectId choice = make.create<Switch>();
    make.node("stage", kRootNode, choice);
    Simulation simulation;
    std::vector<ChangeList> lists{make.builder.take()};
    ASSERT_TRUE(simulation.load(std::move(lists)));
    const Expected<Panel> panel =
        parsePanel(R"(controls { node: "/stage" field: "choice" slider { least: 0.5 greatest: 7.5 } })", "x.panel");
    ASSERT_TRUE(panel);
    const PanelControlState told = stateOf(*panel, simulation.scene()).controls.at(0);
    EXPECT_EQ(told.fault, "");
    EXPECT_EQ(std::vector({told.least, told.greatest, told.step}), (std::vector<double>{1, 7, 1}));
}

TEST_F(DeskPanel, APanelThatIsNoneReachesNothing) {
    const std::string none = "no panel";
    const ConnectionId other = server.hello("other", PeerRole::kApplication);
    desk.applicationJoined(other, {.name = "o", .who = {.role = Role::kEditor, .panel = "q"}}, "", &none);
    visitor = other;
    ChangeListBuilder list;
    setField<&Transform::translation>(list, coreOf("/crane"), Vec3d::Zero());
    EXPECT_WORDS(proposes(list.take()));
}

}  // namespace
}  // namespace tessera
