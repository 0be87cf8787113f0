/// contacts, questions, answer, and what a stopped move met: against a scripted server.
#include <gtest/gtest.h>

#include <algorithm>
#include <future>
#include <sstream>
#include <thread>

#include "client/ctl/Verbs.h"
#include "common/cores/CollisionObject.h"
#include "common/cores/Interest.h"
#include "tests/support/words/Words.h"
#include "tests/unit/HistoryLiterals.h"
#include "tests/unit/application/ScriptedServer.h"

namespace tessera {
namespace {

using test::ScriptedServer;
using Json = nlohmann::json;

constexpr ObjectId kWatch{20}, kWatchCore{21}, kSecond{22}, kSecondCore{23};

/// The crane's scene with two interests and a free body's core on the hook's sibling.
class CollisionVerbs : public testing::Test {
protected:
    CollisionVerbs() {
        ChangeListBuilder edits;
        for (const auto& [node, core, name] :
             {std::tuple(kWatch, kWatchCore, "watch"), std::tuple(kSecond, kSecondCore, "second")}) {
            edits.create(node, typeOf<Node>());
            edits.create(core, typeOf<Interest>());
            edits.place(node, kRootNode);
            edits.set(node, typeOf<Node>(), fieldId<&Node::name>, toValue(std::string(name)));
            edits.set(node, typeOf<Node>(), fieldId<&Node::core>, toValue(core));
            edits.set(core, typeOf<Interest>(), fieldId<&Interest::object>, toValue(test::kCrane));
        }
        server.commit(edits.take());
        server.script([this](const ApplicationRequest& asked) { return answerTo(asked); });
    }

    Expected<ApplicationAnswer> answerTo(const ApplicationRequest& asked) {
        if (std::holds_alternative<request::GetContacts>(asked)) return contacts;
        if (std::holds_alternative<request::GetEvents>(asked)) return events;
        if (std::holds_alternative<request::GetDistances>(asked)) return distances;
        if (std::holds_alternative<request::GetQuestions>(asked)) return questions;
        if (const auto* respond = std::get_if<request::AnswerQuestion>(&asked)) {
            if (respond->reply.question != 7) return fail(ErrorCode::kRefused, "question 8 is over");
            responded = respond->reply;
            return answer::Done{};
        }
        return fail(ErrorCode::kFailed, "unexpected");
    }
    CtlOutcome ctl(std::vector<std::string> words) {
        words.insert(words.begin(), {"--server", server.address(), "--timeout", "5"});
        return runCtl(words);
    }
    Json askJson(std::vector<std::string> words) {
        words.insert(words.begin(), "--json");
        const CtlOutcome outcome = ctl(std::move(words));
        EXPECT_EQ(outcome.exitCode, 0) << outcome.err;
        return Json::parse(outcome.out, nullptr, false);
    }
    /// Waits until somebody has subscribed as `wanted` says, then tells it.
    template <typename Wanted>
    std::future<void> tellOnce(Wanted wanted, std::vector<ApplicationNotice> notices) {
        return std::async(std::launch::async, [this, wanted, notices] {
            while (!wanted(server.subscription())) std::this_thread::yield();
            for (const ApplicationNotice& notice : notices) server.notify(notice);
        });
    }

    static ContactValue contact(ObjectId a, ObjectId b, ObjectId interest) {
        return {.objectA = a,
                .objectB = b,
                .faceA = 1,
                .faceB = ContactValue::kNoFace,
                .point = Vec3d(0.1, 2, 3),
                .normal = Vec3d::UnitX(),
                .interest = interest,
                .time = 0.25};
    }
    static PairEventValue event(TouchPhase phase, ObjectId interest = kWatchCore) {
        return {.interest = interest, .objectA = test::kCrane, .objectB = test::kHall, .phase = phase};
    }

    ScriptedServer server;
    answer::Contacts contacts{.frame = 9_frame, .begun = 3};
    answer::PairEvents events{.frame = 10_frame};
    answer::Distances distances{.frame = 11_frame};
    answer::Questions questions{.frame = 12_frame};
    std::optional<QuestionReply> responded;
};

TEST_F(CollisionVerbs, ContactsAreATableByPaths) {
    contacts.contacts = {contact(test::kHook, test::kHall, kWatchCore), contact(test::kHook, ObjectId{999}, {})};
    contacts.contacts[0].depth = 0.5;
    contacts.contacts[0].uvA = Vec2d(0.25, 0.5);
    contacts.leftOut = 40;
    contacts.notLookedAt = 5;
    EXPECT_EQ(ctl({"contacts"}).out,
              "objects                   faces     point        normal     depth  time  interest\n"
              "/hall/crane/hook - /hall  1 - hull  (0.1, 2, 3)  (1, 0, 0)  0.5    0.25  /watch\n"
              "/hall/crane/hook - #999   1 - hull  (0.1, 2, 3)  (1, 0, 0)  -      0.25  -\n"
              "2 contacts in frame 9, 3 begun so far, 40 more found than are listed; 5 pairs not looked at\n");
    const Json json = askJson({"contacts"});
    EXPECT_EQ(json["contacts"][0]["objects"], Json::array({"/hall/crane/hook", "/hall"}));
    EXPECT_EQ(json["contacts"][0]["faces"], Json::array({1, nullptr})) << "a hull has no face of the file";
    EXPECT_EQ(json["contacts"][0]["interest"], "/watch");
    EXPECT_EQ(json["contacts"][0]["depth"], 0.5);
    EXPECT_EQ(json["contacts"][0]["places"], Json::parse("[[0.25,0.5],[0,0]]"));
    EXPECT_TRUE(json["contacts"][1]["depth"].is_null());
    EXPECT_EQ(json["contacts"][0]["time"].get<double>(), 0.25);
    EXPECT_EQ(json["contacts"][0]["point"][0].get<double>(), 0.1);
    EXPECT_TRUE(json["contacts"][1]["interest"].is_null());
    EXPECT_EQ(json["left_out"], 40);
    EXPECT_EQ(json["not_looked_at"], 5);
}

TEST_F(CollisionVerbs, OfSmoothSurfacesContactsNameTheirOwnFacesAndParameters) {
    contacts.contacts = {contact(test::kHook, test::kHall, kWatchCore)};
    contacts.contacts[0].patchA = 5;
    contacts.contacts[0].patchUvA = Vec2d(0.25, 12.5);
    EXPECT_EQ(ctl({"contacts"}).out,
              "objects                   faces                  point        normal     depth  time  interest\n"
              "/hall/crane/hook - /hall  5 at 0.25 12.5 - hull  (0.1, 2, 3)  (1, 0, 0)  -      0.25  /watch\n"
              "1 contacts in frame 9, 3 begun so far\n");
    const Json one = askJson({"contacts"})["contacts"][0];
    EXPECT_EQ(one["faces"], Json::array({1, nullptr})) << "as they are drawn";
    EXPECT_EQ(one["patches"], Json::parse(R"([{"face":5,"uv":[0.25,12.5]},null])"));
}

TEST_F(CollisionVerbs, ListsAreCutToALimitAndToOneInterest) {
    contacts.contacts = {contact(test::kHook, test::kHall, kWatchCore), contact(test::kHook, test::kCrane, kSecondCore),
                         contact(test::kHall, test::kCrane, kSecondCore)};
    const Json one = askJson({"contacts", "--limit", "1"});
    EXPECT_EQ(one["contacts"].size(), 1u);
    EXPECT_EQ(one["left_out"], 2);
    EXPECT_EQ(ctl({"contacts", "--limit", "0"}).out, "3 contacts in frame 9, 3 begun so far, 3 more than --limit\n");
    EXPECT_EQ(askJson({"contacts", "--interest", "/second"})["contacts"].size(), 2u);
    EXPECT_EQ(ctl({"contacts", "--interest", "/hall/crane"}).exitCode, 3);
    EXPECT_EQ(ctl({"contacts", "--interest", "/nowhere"}).exitCode, 3);
}

TEST_F(CollisionVerbs, EventsAndDistancesOfTheNewestFrame) {
    events.events = {event(TouchPhase::kBegan), event(TouchPhase::kStays), event(TouchPhase::kEnded)};
    events.events[0].firstTime = 0.5;
    events.events[0].point = Vec3d(1, 2, 3);
    events.events[0].normal = Vec3d::UnitZ();
    events.events[2].through = true;
    PairDistanceValue near{.interest = kSecondCore, .objectA = test::kCrane, .objectB = test::kHall};
    near.distance = 0.1;
    near.nodeA = test::kHook;
    near.nodeB = test::kHall;
    near.pointB = Vec3d(0, 0, 0.1);
    PairDistanceValue nearly = near;
    nearly.error = 0.0125;
    distances.distances = {near, nearly};
    EXPECT_EQ(ctl({"contacts", "--events"}).out,
              "event    objects              time  point      normal     interest\n"
              "began    /hall/crane - /hall  0.5   (1, 2, 3)  (0, 0, 1)  /watch\n"
              "stays    /hall/crane - /hall  1     -          -          /watch\n"
              "through  /hall/crane - /hall  1     -          -          /watch\n"
              "3 events in frame 10\n");
    EXPECT_EQ(ctl({"contacts", "--distances"}).out,
              "near   objects              distance      nearest points           interest\n"
              "began  /hall/crane - /hall  0.1           (0, 0, 0) - (0, 0, 0.1)  /second\n"
              "began  /hall/crane - /hall  0.1 +- 0.013  (0, 0, 0) - (0, 0, 0.1)  /second\n"
              "2 distances in frame 11\n");
    const Json both = askJson({"contacts", "--events", "--distances"});
    EXPECT_EQ(both["events"].size(), 3u);
    EXPECT_EQ(both["events"][0]["phase"], "began");
    EXPECT_EQ(both["events"][0]["normal"][2], 1.0);
    EXPECT_TRUE(both["events"][1]["point"].is_null());
    EXPECT_EQ(both["events"][2]["phase"], "ended");
    EXPECT_EQ(both["events"][2]["through"], true);
    EXPECT_EQ(both["distances"][0]["distance"].get<double>(), 0.1);
    EXPECT_EQ(both["distances"][0]["error"], 0.0);
    EXPECT_EQ(both["distances"][1]["error"], 0.0125);
    EXPECT_EQ(both["distances"][0]["nodes"], Json::array({"/hall/crane/hook", "/hall"}));
}

TEST_F(CollisionVerbs, FollowingPrintsEachFrameAsItComesAndEndsAfterSoMany) {
    const auto told = [](std::uint64_t frame, std::vector<PairEventValue> happened) {
        return answer::PairEvents{.frame = FrameNumber(frame), .events = std::move(happened)};
    };
    const std::vector<ApplicationNotice> frames = {told(5, {}), told(6, {event(TouchPhase::kBegan)}),
                                                   told(7, {event(TouchPhase::kEnded), event(TouchPhase::kBegan)}),
                                                   told(8, {event(TouchPhase::kEnded)})};
    const auto telling = tellOnce([](const Subscription& s) { return s.events && !s.stays; }, frames);
    std::vector<std::string> printed;
    const CtlOutcome outcome = runCtl({"--server", server.address(), "--json", "contacts", "--follow", "--frames", "3"},
                                      [&](const std::string& lines) { printed.push_back(lines); });
    EXPECT_EQ(outcome.exitCode, 0) << outcome.err;
    EXPECT_EQ(outcome.out, "") << "all of it was printed as it came";
    ASSERT_EQ(printed.size(), 2u) << "a frame without events is silent, and counts";
    const Json second = Json::parse(printed[1]);
    EXPECT_EQ(second["frame"], 7);
    EXPECT_EQ(second["events"].size(), 2u);
    EXPECT_EQ(std::ranges::count(printed[1], '\n'), 1) << "one object per line";
}

TEST_F(CollisionVerbs, FollowingEndsInOrderWhenTheServerIsOver) {
    auto telling = std::async(std::launch::async, [this] {
        while (!server.subscription().distances) std::this_thread::yield();
        answer::Distances told{.frame = 3_frame};
        told.distances.push_back({.interest = kWatchCore, .objectA = test::kCrane, .objectB = test::kHall});
        server.notify(told);
    });
    std::string printed;
    const CtlOutcome outcome =
        runCtl({"--server", server.address(), "contacts", "--follow", "--distances"}, [&](const std::string& lines) {
            if (printed.empty()) server.notify(answer::Distances{.frame = 4_frame});
            if (printed.empty()) server.finish();
            printed += lines;
        });
    EXPECT_EQ(outcome.exitCode, 0) << outcome.err;
    EXPECT_WORDS(printed);
    EXPECT_WORDS(outcome.out);
    EXPECT_FALSE(server.subscription().events) << "distances alone";
}

TEST_F(CollisionVerbs, FollowingGoesOnWhenABrokenConnectionIsBack) {
    auto cutting = std::async(std::launch::async, [this] {
        while (!server.subscription().events) std::this_thread::yield();
        server.forgetSubscription();
        server.cutAll();
        while (!server.subscription().events) std::this_thread::yield();
        server.finish();
    });
    EXPECT_EQ(ctl({"contacts", "--follow"}).exitCode, 0);
}

TEST_F(CollisionVerbs, WhatIsDrawnIsSetOfOneOrOfAll) {
    const auto show = [&](const std::string& node) { return askJson({"tree", node})["core"]["show"].get<int>(); };
    EXPECT_EQ(askJson({"contacts", "--show", "points,faces"})["interests"], Json::array({"/watch", "/second"}));
    EXPECT_EQ(show("/watch"), Interest::kShowPoints | Interest::kShowFaces);
    EXPECT_EQ(show("/second"), Interest::kShowPoints | Interest::kShowFaces);
    EXPECT_WORDS(ctl({"contacts", "--show", "none", "--interest", "/watch"}).out);
    EXPECT_EQ(show("/watch"), 0);
    EXPECT_EQ(show("/second"), Interest::kShowPoints | Interest::kShowFaces);
    EXPECT_EQ(ctl({"undo"}).exitCode, 0) << "it is an ordinary change";
    EXPECT_EQ(show("/watch"), Interest::kShowPoints | Interest::kShowFaces);
    EXPECT_EQ(ctl({"contacts", "--show", "all"}).exitCode, 2);
    const ScriptedServer without;
    EXPECT_EQ(runCtl({"--server", without.address(), "contacts", "--show", "points"}).exitCode, 3)
        << "no interest, nothing to draw";
}

TEST_F(CollisionVerbs, QuestionsAreListedAndAnswered) {
    QuestionValue q{.id = 7, .interest = kWatchCore, .objectA = test::kCrane, .objectB = test::kHall};
    q.transform = test::kCraneCore;
    q.present = {Vec3d(1, 2, 3), Quatd(0, 1, 0, 0), Vec3d(2, 2, 2)};
    q.wanted.translation = Vec3d(4, 5, 6);
    questions.questions = {q};
    const Json json = askJson({"questions"});
    EXPECT_EQ(json["questions"][0]["question"], 7);
    EXPECT_EQ(json["questions"][0]["present"]["rotation"], Json::array({0.0, 1.0, 0.0, 0.0}));
    EXPECT_EQ(json["questions"][0]["wanted"]["translation"], Json::array({4.0, 5.0, 6.0}));
    EXPECT_WORDS(ctl({"questions"}).out);

    EXPECT_EQ(ctl({"answer", "7", "move", "9", "-8", "7"}).exitCode, 0);
    EXPECT_EQ(responded->decision, QuestionReply::Decision::kMove);
    EXPECT_EQ(responded->pose.translation, Vec3d(9, -8, 7));
    EXPECT_EQ(responded->pose.rotation.coeffs(), Quatd(0, 1, 0, 0).coeffs()) << "as where it was stopped";
    EXPECT_EQ(responded->pose.scale, Vec3d(2, 2, 2));
    EXPECT_EQ(ctl({"answer", "7", "pass"}).exitCode, 0);
    EXPECT_EQ(responded->decision, QuestionReply::Decision::kPass);
    const CtlOutcome late = ctl({"answer", "8", "stop"});
    EXPECT_EQ(late.exitCode, 1);
    EXPECT_EQ(late.err, "tessera-ctl: question 8 is over\n");
    EXPECT_EQ(ctl({"answer", "8", "move", "1", "2", "3"}).exitCode, 1) << "not open, nothing to move";
}

TEST_F(CollisionVerbs, AMoveSaysWhatStoppedIt) {
    server.stopEveryCommit({test::kCraneCore});
    contacts.contacts = {contact(test::kHook, ObjectId{1}, kWatchCore),   // what hangs on the crane touches
                         contact(test::kHall, test::kHook, kWatchCore),   // the other way round
                         contact(test::kHook, test::kHall, kWatchCore),   // the same pair again
                         contact(test::kHook, test::kCrane, kWatchCore),  // two parts of it
                         contact(test::kHall, ObjectId{1}, kWatchCore)};  // two others
    // What it rests on, first in the list, is not what stopped it.
    ContactValue floor = contact(test::kHook, test::kHall, kWatchCore);
    floor.time = 1;
    floor.faceA = 77;
    contacts.contacts.insert(contacts.contacts.begin(), floor);
    const CtlOutcome moved = ctl({"move", "/hall/crane", "1", "0", "0", "--by"});
    EXPECT_WORDS(moved.out);
    const Json json = askJson({"move", "/hall/crane", "1", "0", "0", "--by"});
    EXPECT_EQ(json["stopped"], Json::array({"/hall/crane"}));
    ASSERT_EQ(json["stopped_by"].size(), 2u) << json.dump(2);
    EXPECT_EQ(json["stopped_by"][0]["by"], "/");
    EXPECT_EQ(json["stopped_by"][1]["normal"], Json::array({-1.0, 0.0, 0.0})) << "from what was moved to what it met";
    EXPECT_EQ(json["stopped_by"][1]["faces"], Json::array({nullptr, 1}));

    contacts.contacts = {floor};
    EXPECT_EQ(askJson({"move", "/hall/crane", "1", "0", "0"})["stopped_by"].size(), 1u)
        << "pressed on what it rests on";
    contacts.contacts.clear();
    const std::string set = ctl({"set", "/hall/crane", "scale", "0", "0", "0"}).out;
    EXPECT_WORDS(set);
    EXPECT_WORDS(ctl({"move", "/hall/crane", "1", "0", "0"}).out);  // where the contacts do not tell
    EXPECT_TRUE(askJson({"move", "/hall/crane", "1", "0", "0"})["stopped_by"].empty());
}

TEST_F(CollisionVerbs, FieldsOfInterestsAndBodiesAreSetByName) {
    ChangeListBuilder edits;
    const ObjectId node{30}, core{31};
    edits.create(node, typeOf<Node>());
    edits.create(core, typeOf<CollisionObject>());
    edits.place(node, kRootNode);
    edits.set(node, typeOf<Node>(), fieldId<&Node::name>, toValue(std::string("body")));
    edits.set(node, typeOf<Node>(), fieldId<&Node::core>, toValue(core));
    server.commit(edits.take());
    for (const std::string words :
         {"/body velocity 1 -2 3", "/body spin 0 0 0.5", "/body mass 2.5", "/body kind deforming", "/body layers 6",
          "/body node /hall/crane", "/watch response slide", "/watch mode distance", "/watch threshold 0.25",
          "/watch detail yes-or-no", "/watch show normals", "/watch against none", "/watch patience 3"}) {
        std::istringstream in("set " + words);
        std::vector<std::string> split;
        for (std::string word; in >> word;) split.push_back(word);
        EXPECT_EQ(ctl(split).exitCode, 0) << words << ": " << ctl(split).err;
    }
    const Json body = askJson({"tree", "/body"})["core"], watch = askJson({"tree", "/watch"})["core"];
    EXPECT_EQ(body["velocity"], Json::array({1.0, -2.0, 3.0}));
    EXPECT_EQ(body["mass"], 2.5);
    EXPECT_EQ(body["kind"], CollisionObject::kDeforming);
    EXPECT_EQ(body["node"], test::kCrane.value);
    EXPECT_EQ(watch["response"], Interest::kSlide);
    EXPECT_EQ(watch["mode"], Interest::kDistance);
    EXPECT_EQ(watch["detail"], Interest::kYesOrNo);
    EXPECT_NE(ctl({"set", "/watch", "response", "17"}).exitCode, 0) << "the scene's own limits hold";
    EXPECT_NE(ctl({"set", "/body", "mass", "-1"}).exitCode, 0);
    EXPECT_EQ(ctl({"set", "/watch", "response", "slowly"}).exitCode, 2);
}

}  // namespace
}  // namespace tessera
