/// What an application is told of collisions, and how it answers.
#include <gtest/gtest.h>

#include "common/application/Application.h"
#include "common/application/Connection.h"
#include "tests/unit/HistoryLiterals.h"
#include "tests/unit/application/ScriptedServer.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;
using Decision = QuestionReply::Decision;
using test::ScriptedServer;

std::unique_ptr<Application> joinAndAsk(const ScriptedServer& server) {
    auto application = Application::connect({.address = server.address(), .name = "test", .followScene = false});
    EXPECT_TRUE(application) << (application ? "" : application.error().message);
    return application ? std::move(*application) : nullptr;
}

QuestionValue question(std::uint64_t id) {
    return {.id = id, .interest = ObjectId{8}, .objectA = test::kCrane, .transform = test::kCraneCore};
}

TEST(Collisions, EachKindIsSubscribedToByItself) {
    ScriptedServer server;
    const auto application = joinAndAsk(server);
    ASSERT_TRUE(application);
    const auto bits = [&] {
        const Subscription s = server.subscription();
        return std::array{s.contacts, s.events, s.stays, s.distances, s.questions};
    };
    ASSERT_TRUE(application->onPairEvents([](const answer::PairEvents&) {}));
    EXPECT_EQ(bits(), (std::array{false, true, false, false, false})) << "stays only for those who ask for them";
    ASSERT_TRUE(application->onPairEvents([](const answer::PairEvents&) {}, {.stays = true}));
    EXPECT_EQ(bits(), (std::array{false, true, true, false, false}));
    ASSERT_TRUE(application->onDistances([](const answer::Distances&) {}));
    ASSERT_TRUE(application->onQuestions([](const answer::Questions&) {}));
    EXPECT_EQ(bits(), (std::array{false, true, true, true, true}));
    ASSERT_TRUE(application->onPairEvents(nullptr, {.stays = true}));
    EXPECT_EQ(bits(), (std::array{false, false, false, true, true})) << "nothing stays without events";
}

TEST(Collisions, EachKindReachesItsOwnCallback) {
    ScriptedServer server;
    const auto application = joinAndAsk(server);
    ASSERT_TRUE(application);
    std::vector<std::string> told;
    ASSERT_TRUE(application->onPairEvents(
        [&](const answer::PairEvents& e) { told.push_back("events " + std::to_string(e.events.size())); }));
    ASSERT_TRUE(application->onDistances(
        [&](const answer::Distances& d) { told.push_back("distance " + std::to_string(d.distances.at(0).faceB)); }));
    ASSERT_TRUE(application->onQuestions(
        [&](const answer::Questions& q) { told.push_back("closed " + std::to_string(q.closed.at(0))); }));
    server.notify(answer::Contacts{});
    server.notify(answer::PairEvents{.frame = 1_frame, .events = {{}, {}}});
    PairDistanceValue near;
    near.faceB = 7;
    server.notify(answer::Distances{.frame = 1_frame, .distances = {near}});
    server.notify(answer::Questions{.frame = 1_frame, .closed = {5}});
    while (told.size() < 3) ASSERT_TRUE(application->poll(5s));
    EXPECT_EQ(told, (std::vector<std::string>{"events 2", "distance 7", "closed 5"}));
}

TEST(Collisions, AQuestionIsAnsweredFromWithinItsCallback) {
    ScriptedServer server;
    std::vector<QuestionReply> answers;
    server.script([&](const ApplicationRequest& asked) -> Expected<ApplicationAnswer> {
        const auto* respond = std::get_if<request::AnswerQuestion>(&asked);
        if (respond == nullptr) return fail(ErrorCode::kFailed, "unexpected");
        if (respond->reply.question != 3) return fail(ErrorCode::kRefused, "question 4 is not open");
        answers.push_back(respond->reply);
        return answer::Done{};
    });
    const auto application = joinAndAsk(server);
    ASSERT_TRUE(application);
    std::vector<Error> refusals;
    bool done = false;
    ASSERT_TRUE(application->onQuestions([&](const answer::Questions& asked) {
        for (const QuestionValue& q : asked.questions) {
            const Pose beside{q.present.translation + Vec3d(0, 1, 0), q.present.rotation, q.present.scale};
            const auto responded = application->respond(q.id, Decision::kMove, beside);
            if (!responded) refusals.push_back(responded.error());
        }
        done = true;
    }));
    server.notify(answer::Questions{.frame = 9_frame, .questions = {question(3), question(4)}});
    while (!done) ASSERT_TRUE(application->poll(5s));
    ASSERT_EQ(answers.size(), 1u);
    EXPECT_EQ(answers[0].decision, Decision::kMove);
    EXPECT_EQ(answers[0].pose.translation, Vec3d(0, 1, 0));
    ASSERT_EQ(refusals.size(), 1u);
    EXPECT_EQ(refusals[0].code, ErrorCode::kRefused);
}

TEST(Collisions, TheNewestFrameCanBeAskedFor) {
    ScriptedServer server;
    server.script([&](const ApplicationRequest& asked) -> Expected<ApplicationAnswer> {
        if (std::holds_alternative<request::GetEvents>(asked))
            return answer::PairEvents{.frame = 1_frame, .events = {{}}};
        if (std::holds_alternative<request::GetDistances>(asked))
            return answer::Distances{.frame = 2_frame, .leftOut = 4};
        if (std::holds_alternative<request::GetQuestions>(asked))
            return answer::Questions{.frame = 3_frame, .questions = {question(17)}};
        return fail(ErrorCode::kFailed, "unexpected");
    });
    const auto application = joinAndAsk(server);
    ASSERT_TRUE(application);
    EXPECT_EQ(application->pairEvents()->events.size(), 1u);
    EXPECT_EQ(application->distances()->leftOut, 4u);
    EXPECT_EQ(application->questions()->questions.at(0).id, 17u);
    EXPECT_EQ(application->respond(1, Decision::kPass).error().message, "unexpected");
}

/// The next notice that comes, as the frame it speaks of.
std::uint64_t nextNotice(Connection& connection) {
    for (;;) {
        const std::optional<Incoming> value = connection.next(clockNow() + 5s);
        if (!value) return 0;
        if (const auto* notice = std::get_if<incoming::Notice>(&*value))
            return std::get<answer::PairEvents>(notice->notice).frame.value;
    }
}

/// Notices that nobody polls for are dropped before they fill the memory, and those that are fetched make room again.
TEST(Collisions, OneWhoDoesNotPollMissesNoticesAndKeepsItsConnection) {
    ScriptedServer server;
    const auto events = [](std::uint64_t frame, std::size_t count) {
        return answer::PairEvents{.frame = FrameNumber(frame), .events = std::vector<PairEventValue>(count)};
    };
    ConnectionOptions options;
    options.address = *parseAddress(server.address());
    options.name = "test";
    options.lists = false;
    options.maxWaitingBytes = 2 * encodeNotice(events(31, 100)).size();
    Connection connection(options);
    while (!std::holds_alternative<incoming::Configured>(*connection.next(clockNow() + 5s))) continue;
    for (const std::uint64_t round : {10u, 20u, 30u}) {
        server.notify(events(round, 101));  // more than ever may wait
        server.notify(events(round + 1, 100));
        EXPECT_EQ(nextNotice(connection), round + 1);
    }
}

}  // namespace
}  // namespace tessera
