// Which role may say which request, as their descriptions have it.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <map>

#include "common/codec/ChangeCodec.h"
#include "common/request/Catalogue.h"
#include "tests/support/words/Words.h"
#include "tests/unit/sim/DeskStage.h"

namespace tessera {
namespace {

class DeskRoles : public test::DeskStage {
protected:
    ConnectionId join(Role role) {
        const ConnectionId connection = server.hello("somebody", PeerRole::kApplication);
        desk.applicationJoined(connection, {.name = fmt::format("a {}", nameOf(role)), .who = {.role = role}});
        return connection;
    }
    /// Whether it is refused for its role; whatever else is wrong with saying nothing.
    bool refusedForItsRole(ConnectionId connection, const ApplicationRequest& request) {
        server.forget();
        last_ = "no answer";
        server.take(desk.received({connection, "somebody", ++asked_, share(encodeRequest(request))}, server.now));
        for (const message::Reply& reply : server.sent<message::Reply>(connection))
            if (last_ = reply.error; last_.find("; this link is of a") != std::string::npos) return true;
        return false;
    }
    template <typename Request, typename... More>
    void eachOf(std::variant<Request, More...>*) {
        for (const Role role : {Role::kViewer, Role::kEditor, Role::kOperator}) {
            ++looked_;
            const ConnectionId connection = of_.contains(role) ? of_.at(role) : of_[role] = join(role);
            Request request;
            // It has to be sayable: others are refused before anybody looks at who says them.
            if constexpr (std::is_same_v<Request, request::ProposeChanges>) request.list = share(encodeChangeList({}));
            EXPECT_EQ(refusedForItsRole(connection, request), role < Request::kInfo.role)
                << Request::kInfo.name << " by a " << nameOf(role) << ": " << last_;
        }
        if constexpr (sizeof...(More) > 0) eachOf(static_cast<std::variant<More...>*>(nullptr));
    }

    RequestDesk desk{surroundings()};
    std::uint64_t asked_ = 0;
    std::string last_;
    std::map<Role, ConnectionId> of_;
    std::size_t looked_ = 0;
};

TEST_F(DeskRoles, EachRequestIsForItsRoleAndThoseAboveIt) {
    eachOf(static_cast<ApplicationRequest*>(nullptr));
    EXPECT_EQ(looked_, 3 * allRequests().size());
}

/// Nothing of it is looked at: nor does a second request in the same message get past.
TEST_F(DeskRoles, WhatMayNotBeSaidIsRefusedBeforeItIsRead) {
    const ConnectionId viewer = join(Role::kViewer), editor = join(Role::kEditor);
    const auto answerTo = [&](ConnectionId connection, Bytes head) {
        Bytes body(8);
        body[0] = static_cast<std::byte>(head.size());
        body.insert(body.end(), head.begin(), head.end());
        server.forget();
        server.take(desk.received({connection, "somebody", ++asked_, share(std::move(body))}, server.now));
        return server.sent<message::Reply>(connection).at(0).error;
    };
    const auto member = [](int number, Bytes inner) {
        Bytes bytes{static_cast<std::byte>((number << 3 & 0x7F) | 2)};
        if (number >= 16)
            bytes = {static_cast<std::byte>((number << 3 & 0x7F) | 0x82), static_cast<std::byte>(number >> 4)};
        bytes.push_back(static_cast<std::byte>(inner.size()));
        bytes.insert(bytes.end(), inner.begin(), inner.end());
        return bytes;
    };
    const Bytes rubbish(5, std::byte{0xFF}), status = member(request::GetStatus::kInfo.number, {});
    for (const RequestText& request : allRequests()) {
        if (request.info.role == Role::kViewer) continue;
        const Bytes said = member(request.info.number, rubbish);
        EXPECT_WORDS(answerTo(viewer, said));
        const bool mayEditor = request.info.role == Role::kEditor;
        EXPECT_EQ(answerTo(editor, said).find("; this link is of an editor") == std::string::npos, mayEditor)
            << request.info.name;
        for (const bool first : {true, false}) {
            Bytes both = first ? said : status;
            both.insert(both.end(), (first ? status : said).begin(), (first ? status : said).end());
            EXPECT_WORDS(answerTo(viewer, both));
        }
    }
}

TEST_F(DeskRoles, WhoHasGoneMayChangeNothing) {
    const ConnectionId connection = join(Role::kOperator);
    EXPECT_FALSE(refusedForItsRole(connection, request::UndoStep{}));
    desk.applicationLeft(connection);
    EXPECT_TRUE(refusedForItsRole(connection, request::UndoStep{}));
}

TEST_F(DeskRoles, EachIsToldWhoItIs) {
    for (const Role role : {Role::kViewer, Role::kEditor, Role::kOperator}) {
        const ConnectionId connection = join(role);
        server.forget();
        server.take(desk.received({connection, "somebody", 1, share(encodeRequest(request::WhoAmI{}))}, server.now));
        const auto replies = server.sent<message::Reply>(connection);
        ASSERT_EQ(replies.size(), 1u);
        const Expected<ApplicationAnswer> answer = decodeAnswer(replies[0].body);
        ASSERT_TRUE(answer) << answer.error().message;
        const auto& who = std::get<answer::Identity>(*answer);
        EXPECT_EQ(who.role, role);
        EXPECT_EQ(who.name, fmt::format("a {}", nameOf(role)));
    }
}

TEST_F(DeskRoles, ArraysAreReadInPiecesByTheirNames) {
    const ConnectionId connection = join(Role::kViewer);
    Bytes bytes(2'500'000);
    for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::byte>(i * 31 % 251);
    const Blob array = blobs.add(Blob(bytes));
    const auto ask = [&](const request::GetArray& wish) -> Expected<answer::ArrayPiece> {
        server.forget();
        server.take(desk.received({connection, "somebody", ++asked_, share(encodeRequest(wish))}, server.now));
        const auto replies = server.sent<message::Reply>(connection);
        if (replies.empty()) return fail(ErrorCode::kFailed, "no answer");
        if (!replies[0].error.empty()) return fail(ErrorCode::kRefused, replies[0].error);
        Expected<ApplicationAnswer> answer = decodeAnswer(replies[0].body);
        if (!answer) return tl::unexpected(answer.error());
        return std::get<answer::ArrayPiece>(*answer);
    };
    Bytes read;
    while (read.size() < bytes.size()) {
        const auto piece = ask({.blob = toHex(array.id()), .offset = read.size()});
        ASSERT_TRUE(piece) << piece.error().message;
        ASSERT_EQ(piece->size, bytes.size());
        ASSERT_LE(piece->bytes.size(), ApplicationLimits().maxPieceBytes);
        ASSERT_FALSE(piece->bytes.empty());
        read.insert(read.end(), piece->bytes.bytes().begin(), piece->bytes.bytes().end());
    }
    EXPECT_EQ(read, bytes);
    const auto few = ask({.blob = toHex(array.id()), .offset = bytes.size() - 3, .length = 10});
    ASSERT_TRUE(few);
    EXPECT_EQ(few->bytes.size(), 3u);
    EXPECT_WORDS(ask({.blob = toHex(array.id()), .offset = bytes.size() + 1}).error().message);
    EXPECT_WORDS(ask({.blob = "abc"}).error().message);
    EXPECT_WORDS(ask({.blob = std::string(32, 'f')}).error().message);
    EXPECT_WORDS(ask({.blob = toHex(array.id()), .length = 1'000'000}).error().message);
}

}  // namespace
}  // namespace tessera
