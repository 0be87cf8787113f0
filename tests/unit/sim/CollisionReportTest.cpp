/// report.json's `collision`: sums over the run, lists of the last frame, names for a person.
#include "server/sim/report/CollisionReport.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "common/scene/FieldTable.h"
#include "server/sim/report/Report.h"

namespace tessera {
namespace {

constexpr ObjectId kHall{2}, kCrane{3}, kWatch{4}, kInterest{5};

Aspect reportedHall() {
    ChangeListBuilder edits;
    edits.create(kHall, typeOf<Node>());
    edits.create(kCrane, typeOf<Node>());
    edits.create(kWatch, typeOf<Node>());
    edits.create(kInterest, typeOf<Interest>());
    edits.place(kHall, kRootNode);
    edits.place(kCrane, kHall);
    edits.place(kWatch, kHall);
    edits.set(kHall, typeOf<Node>(), fieldId<&Node::name>, toValue(std::string("hall")));
    edits.set(kCrane, typeOf<Node>(), fieldId<&Node::name>, toValue(std::string("crane")));
    edits.set(kWatch, typeOf<Node>(), fieldId<&Node::name>, toValue(std::string("watch")));
    edits.set(kWatch, typeOf<Node>(), fieldId<&Node::core>, toValue(kInterest));
    Aspect scene;
    EXPECT_TRUE(scene.apply(edits.take()));
    return scene;
}

StepResult eventful() {
    StepResult step;
    step.contactsBegun = 2;
    step.contacts.push_back({.objectA = kCrane,
                             .objectB = ObjectId{99},
                             .faceA = 1,
                             .faceB = 2,
                             .point = Vec3d(0.1, 0, 0),
                             .normal = Vec3d::UnitY(),
                             .interest = kInterest,
                             .time = 0.3});
    step.contacts.push_back({.objectA = kCrane, .objectB = kHall});
    step.events.push_back({.interest = kInterest, .objectA = kCrane, .objectB = kHall, .phase = Phase::kBegan});
    step.events.push_back({.interest = kInterest, .objectA = kCrane, .objectB = kHall, .phase = Phase::kStays});
    step.events.push_back({.interest = kInterest, .objectA = kCrane, .objectB = kHall, .phase = Phase::kEnded});
    step.events.push_back(
        {.interest = kInterest, .objectA = kCrane, .objectB = kHall, .phase = Phase::kEnded, .through = true});
    PairDistance near{.interest = kInterest, .objectA = kCrane, .objectB = kHall, .phase = Phase::kStays};
    near.distance = 0.1;
    near.nodeA = kCrane;
    near.nodeB = kHall;
    near.pointB = Vec3d(0, 0, 0.1);
    step.distances.push_back(near);
    step.notLookedAt.push_back({.nodeA = kCrane, .nodeB = {}, .reason = NotLookedAt::Reason::kNotFinite});
    step.notLookedAt.push_back({.nodeA = kCrane, .nodeB = kHall, .reason = NotLookedAt::Reason::kWork});
    step.counters = {.objects = 7,
                     .skipped = 1,
                     .freeBodies = 4,
                     .asleep = 3,
                     .neighbours = 9,
                     .pairsTested = 10,
                     .boxTests = 200,
                     .triangleTests = 300,
                     .notLookedAt = 2,
                     .contactsLeftOut = 5,
                     .eventsLeftOut = 6,
                     .unanswered = 1};
    return step;
}

TEST(CollisionReport, SumsTheRunAndListsTheLastFrame) {
    CollisionReport report;
    report.frameDone(eventful());
    StepResult idle;
    idle.counters = {.objects = 8, .pairsTested = 1, .boxTests = 1, .triangleTests = 2};
    report.frameDone(idle);
    report.frameDone(eventful());
    const nlohmann::ordered_json json = report.toJson(reportedHall());
    EXPECT_EQ(json["objects"], 7);
    EXPECT_EQ(json["skipped"], 1);
    EXPECT_EQ(json["free_bodies"], 4);
    EXPECT_EQ(json["asleep"], 3);
    EXPECT_EQ(json["pairs_tested"], 21);
    EXPECT_EQ(json["box_tests"], 401);
    EXPECT_EQ(json["triangle_tests"], 602);
    EXPECT_EQ(json["contacts"], 4);
    EXPECT_EQ(json["contacts_left_out"], 10);
    EXPECT_EQ(json["events"], (nlohmann::ordered_json{{"began", 4}, {"ended", 4}, {"left_out", 12}}));
    EXPECT_EQ(json["unanswered"], 2);
    EXPECT_EQ(json["budget"]["max_tests"], CollisionLimits().maxTests);
    EXPECT_DOUBLE_EQ(json["budget"]["largest_share"].get<double>(),
                     500.0 / static_cast<double>(CollisionLimits().maxTests))
        << "of one frame, not of the run";
    EXPECT_EQ(json["contact_list"].size(), 2u);
    EXPECT_EQ(json["distances"].size(), 1u);
}

TEST(CollisionReport, NamesByPathsAndWhatIsGoneByItsNumber) {
    CollisionReport report;
    report.frameDone(eventful());
    const nlohmann::ordered_json json = report.toJson(reportedHall());
    const auto& contact = json["contact_list"][0];
    EXPECT_EQ(contact["objects"], nlohmann::ordered_json::array({"/hall/crane", "#99"}));
    EXPECT_EQ(contact["faces"], nlohmann::ordered_json::array({1, 2}));
    EXPECT_EQ(contact["point"][0].get<double>(), 0.1);
    EXPECT_EQ(contact["interest"], "/hall/watch");
    EXPECT_EQ(contact["time"].get<double>(), 0.3);
    EXPECT_TRUE(json["contact_list"][1]["interest"].is_null());
    const auto& distance = json["distances"][0];
    EXPECT_EQ(distance["objects"], nlohmann::ordered_json::array({"/hall/crane", "/hall"}));
    EXPECT_EQ(distance["phase"], "stays");
    EXPECT_EQ(distance["points"][1][2].get<double>(), 0.1);
    const auto& missed = json["not_looked_at"];
    EXPECT_EQ(missed["count"], 2);
    EXPECT_EQ(missed["list"][0], (nlohmann::ordered_json{{"nodes", {"/hall/crane"}}, {"reason", "not finite"}}));
    EXPECT_EQ(missed["list"][1]["nodes"], nlohmann::ordered_json::array({"/hall/crane", "/hall"}));
    EXPECT_EQ(missed["list"][1]["reason"], "work");
    EXPECT_NE(json.dump().find("\"distance\":0.1,"), std::string::npos) << "every digit, none too many";
}

TEST(CollisionReport, ListsAreBounded) {
    StepResult many;
    many.contacts = std::vector<Contact>(5000, {.objectA = kCrane, .objectB = kHall});
    many.distances = std::vector<PairDistance>(5000);
    many.notLookedAt.resize(5000);
    CollisionReport report;
    report.frameDone(many);
    const nlohmann::ordered_json json = report.toJson(reportedHall());
    EXPECT_EQ(json["contact_list"].size(), 1000u);
    EXPECT_EQ(json["distances"].size(), 1000u);
    EXPECT_EQ(json["not_looked_at"]["list"].size(), 100u);
}

TEST(Report, OfManyFaultsTheFirstAndTheLastAreListedAndTheOthersCounted) {
    Report report(Wall(), "hall.tsct");
    constexpr std::uint64_t kFaults = 3'000;
    for (std::uint64_t i = 0; i < kFaults; ++i) {
        report.fault({.host = "left",
                      .kind = FaultKind::kDisconnected,
                      .frame = FrameNumber(i),
                      .detectedAfter = {},
                      .detail = {}});
        report.entered(
            {.host = "left", .frame = FrameNumber(i), .rejoined = true, .awayFor = std::chrono::milliseconds(i)});
    }
    const nlohmann::json json = nlohmann::json::parse(report.toJson(Aspect(), FrameBudget(0), ExposureMeter({})));
    const nlohmann::json& faults = json["faults"];
    ASSERT_EQ(faults.size(), Report::kFirstFaults + Report::kLastFaults);
    EXPECT_EQ(json["faults_left_out"], kFaults - faults.size());
    EXPECT_EQ(faults.front()["frame"], 0);
    EXPECT_EQ(faults[Report::kFirstFaults - 1]["frame"], Report::kFirstFaults - 1);
    EXPECT_EQ(faults[Report::kFirstFaults]["frame"], kFaults - Report::kLastFaults);
    EXPECT_EQ(faults.back()["frame"], kFaults - 1);
    EXPECT_EQ(faults.back()["rejoined_ms"], kFaults - 1.0);
}

TEST(CollisionReport, StandsInReportJsonWithItsTimes) {
    Report report(Wall(), "hall.tsct");
    FrameResult frame;
    frame.collision = eventful();
    frame.collisionMs = 1.5;
    report.frameCommitted(frame);
    const auto json = nlohmann::json::parse(report.toJson(reportedHall(), FrameBudget(0), ExposureMeter({})));
    EXPECT_EQ(json["collision"]["ms"]["p99"], 1.5);
    EXPECT_EQ(json["collision"]["contacts"], 2);
    EXPECT_EQ(json["collision"]["not_looked_at"]["count"], 2);
}

}  // namespace
}  // namespace tessera
