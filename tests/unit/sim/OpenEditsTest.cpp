// What is open: an edit from its asking to its outcome, without anybody's request.
#include "server/sim/desk/OpenEdits.h"

#include <gtest/gtest.h>

#include "common/scene/FieldTable.h"
#include "tests/unit/sim/DeskStage.h"

namespace tessera {
namespace {

class OpenEditsBook : public test::DeskStage {
protected:
    static Edit oneNode() {
        test::ListMaker maker;
        maker.node("n", kRootNode);
        return {.list = maker.builder.take()};
    }
    [[nodiscard]] Asker asker(std::uint64_t request = 1) const {
        return {.connection = application, .request = request};
    }
    /// What its asker is told by these actions: the error, empty where it is good; nothing: no answer.
    std::optional<std::string> told(ServerActions actions) {
        server.forget();
        server.take(std::move(actions));
        const auto replies = server.sent<message::Reply>(application);
        return replies.empty() ? std::nullopt : std::optional(replies[0].error);
    }

    std::optional<Error> trouble;
    DeskSurroundings around = withTrouble();
    [[nodiscard]] DeskSurroundings withTrouble() {
        DeskSurroundings all = surroundings();
        all.editsRefused = [this] { return trouble; };
        return all;
    }
    RequestDesk::Limits limits{.maxLeftBehind = 2};
    OpenEdits edits{around, limits};
    ConnectionId application = server.hello("somebody", PeerRole::kApplication);
};

TEST_F(OpenEditsBook, AnEditIsTakenOnceAndToldOnce) {
    EXPECT_FALSE(told(edits.enter({.asker = asker(), .edit = oneNode()}, {}, server.now)));
    EXPECT_EQ(edits.countOf(application).edits, 1u);
    const std::vector<Edit> taken = edits.takeEdits();
    ASSERT_EQ(taken.size(), 1u);
    EXPECT_TRUE(edits.takeEdits().empty());
    const std::uint64_t ticket = taken[0].ticket;
    ASSERT_TRUE(edits.find(ticket));
    EXPECT_FALSE(told(edits.committed({{.ticket = ticket, .underWay = true}}))) << "it takes several frames";
    EXPECT_EQ(told(edits.committed({{.ticket = ticket}})), "");
    EXPECT_FALSE(edits.find(ticket));
    EXPECT_FALSE(told(edits.committed({{.ticket = ticket}})));
    EXPECT_EQ(edits.countOf(application).edits, 0u);
}

/// A Begin carries them all.
TEST_F(OpenEditsBook, LargeProposalsOpenSeveralFrames) {
    const std::size_t each = limits.maxFrameBytes / 3;
    for (std::uint64_t i = 1; i <= 7; ++i)
        EXPECT_FALSE(told(edits.enter({.asker = asker(i), .edit = oneNode(), .bytes = each}, {}, server.now)));
    std::vector<std::size_t> taken;
    for (std::vector<Edit> next = edits.takeEdits(); !next.empty(); next = edits.takeEdits())
        taken.push_back(next.size());
    EXPECT_EQ(taken, (std::vector<std::size_t>{3, 3, 1}));
}

TEST_F(OpenEditsBook, WhatIsRefusedIsToldWhyAndIsOpenNoMore) {
    trouble = Error{ErrorCode::kFailed, "the disk is full"};
    EXPECT_EQ(told(edits.enter({.asker = asker(), .edit = oneNode()}, {}, server.now)), "the disk is full");
    trouble.reset();
    EXPECT_TRUE(edits.takeEdits().empty());
    (void)edits.enter({.asker = asker(), .edit = oneNode()}, {}, server.now);
    const std::uint64_t ticket = edits.takeEdits().at(0).ticket;
    EXPECT_EQ(told(edits.committed({{.ticket = ticket, .result = fail(ErrorCode::kRefused, "no")}})), "no");
    EXPECT_EQ(edits.countOf(application).edits, 0u);
}

TEST_F(OpenEditsBook, PartsComeOneAFrameAndOneEditBehindTheOther) {
    std::vector<std::uint64_t> tickets;
    for (int i = 0; i < 2; ++i) {
        std::vector<ChangeList> parts;
        for (int part = 0; part < 3; ++part) parts.push_back(oneNode().list);
        tickets.push_back(edits.newTicket());
        edits.open(tickets.back(), {.asker = asker(), .isLoad = true, .parts = std::move(parts)});
        (void)edits.queue(tickets.back(), {}, server.now);
    }
    for (const std::uint64_t ticket : tickets)
        for (int part = 0; part < 3; ++part) {
            std::vector<Edit> frame = edits.takeEdits();
            EXPECT_TRUE(frame.empty());
            edits.takePart(frame);
            ASSERT_EQ(frame.size(), 1u);
            EXPECT_EQ(frame[0].ticket, ticket);
            EXPECT_EQ(frame[0].kind, part < 2 ? Edit::Kind::kPart : Edit::Kind::kLastPart);
            const auto answer = told(edits.committed({{.ticket = ticket}}));
            EXPECT_EQ(answer.has_value(), part == 2) << "with the last part";
        }
    std::vector<Edit> step{{.kind = Edit::Kind::kUndo}};
    edits.takePart(step);
    EXPECT_EQ(step.size(), 1u);
}

/// What is in a frame is not cancelled, whether one part or the last of several.
TEST_F(OpenEditsBook, WhatHostsHaveWaitsForThemNoMore) {
    for (const std::size_t count : {1u, 3u}) {
        const std::uint64_t ticket = edits.newTicket();
        edits.open(ticket, {.asker = asker(), .isLoad = true, .parts = std::vector<ChangeList>(count)});
        EXPECT_FALSE(edits.waitsForHosts(ticket));
        (void)edits.queue(ticket, {Blob::of<float>(std::vector<float>(3))}, server.now);
        EXPECT_TRUE(edits.waitsForHosts(ticket));
        edits.blobsEverywhere(ticket);
        for (std::size_t part = 0; part < count; ++part) {
            EXPECT_FALSE(edits.waitsForHosts(ticket)) << part;
            std::vector<Edit> frame = edits.takeEdits();
            edits.takePart(frame);
            ASSERT_EQ(frame.size(), 1u);
        }
        EXPECT_FALSE(edits.waitsForHosts(ticket)) << "it is under way";
        EXPECT_EQ(edits.appearing().size(), 1u);
        (void)edits.committed({{.ticket = ticket}});
    }
}

TEST_F(OpenEditsBook, APartThatIsRefusedTakesTheOthersWithIt) {
    std::vector<ChangeList> parts(3);
    const std::uint64_t ticket = edits.newTicket();
    edits.open(ticket, {.asker = asker(), .isLoad = true, .parts = std::move(parts)});
    (void)edits.queue(ticket, {}, server.now);
    std::vector<Edit> frame = edits.takeEdits();
    edits.takePart(frame);
    ASSERT_EQ(frame.size(), 1u);
    EXPECT_EQ(told(edits.committed({{.ticket = ticket, .result = fail(ErrorCode::kRefused, "no")}})), "no");
    frame = edits.takeEdits();
    edits.takePart(frame);
    EXPECT_TRUE(frame.empty());
}

TEST_F(OpenEditsBook, OfThoseWhoHaveLeftTheNewestEditsDoNotCount) {
    for (int i = 0; i < 5; ++i) (void)edits.enter({.asker = asker(), .edit = oneNode()}, {}, server.now);
    edits.forgetLeftBehind([&](ConnectionId one) { return one == application; });
    EXPECT_EQ(edits.countOf(application).edits, 5u) << "it is there";
    edits.forgetLeftBehind([](ConnectionId) { return false; });
    const std::vector<Edit> taken = edits.takeEdits();
    ASSERT_EQ(taken.size(), 2u);
    EXPECT_LT(taken[0].ticket, taken[1].ticket);
    EXPECT_EQ(taken[0].ticket, OpenEdits::kStartScene + 1);
}

TEST_F(OpenEditsBook, BytesCountPerApplicationAndOfCopiesTogether) {
    edits.open(edits.newTicket(), {.asker = asker(), .bytes = 100});
    edits.open(edits.newTicket(), {.asker = asker(), .bytes = 20, .isCopy = true});
    edits.open(edits.newTicket(), {.asker = {.connection = ConnectionId{99}}, .bytes = 3, .isCopy = true});
    EXPECT_EQ(edits.countOf(application).edits, 2u);
    EXPECT_EQ(edits.countOf(application).bytes, 120u);
    EXPECT_EQ(edits.copiedBytes(), 23u);
}

}  // namespace
}  // namespace tessera
