/// What a step found, as it is told: every value in its place, and what is left out is counted.
#include "server/sim/desk/CollisionAnswers.h"

#include <gtest/gtest.h>

#include "common/codec/ApplicationCodec.h"
#include "server/sim/desk/FrameNews.h"
#include "tests/unit/HistoryLiterals.h"

namespace tessera {
namespace {

StepResult someStep() {
    StepResult step;
    step.contacts.push_back({.objectA = ObjectId{1},
                             .objectB = ObjectId{2},
                             .faceA = 3,
                             .faceB = Contact::kNoFace,
                             .point = Vec3d(1, 2, 3),
                             .normal = Vec3d::UnitZ(),
                             .interest = ObjectId{9},
                             .time = 0.25});
    for (std::uint64_t i = 0; i < 6; ++i) {
        PairEvent event{.interest = ObjectId{9}, .objectA = ObjectId{10 + i}, .objectB = ObjectId{20 + i}};
        event.phase = static_cast<Phase>(i % 3);  // began, stays, ended, twice
        event.firstTime = 0.1 * static_cast<double>(i);
        event.point = Vec3d(double(i), 0, 0);
        event.normal = Vec3d::UnitX();
        event.through = i == 5;
        step.events.push_back(event);
    }
    for (std::uint64_t i = 0; i < 3; ++i) {
        PairDistance pair{.interest = ObjectId{8}, .objectA = ObjectId{30 + i}, .objectB = ObjectId{40}};
        pair.phase = static_cast<Phase>(i);
        pair.distance = 0.5 - 0.1 * static_cast<double>(i);
        pair.error = 0.01 * static_cast<double>(i);
        pair.nodeA = ObjectId{50};
        pair.nodeB = ObjectId{51};
        pair.faceA = 52;
        pair.faceB = 53;
        pair.pointA = Vec3d(1, 1, 1);
        pair.pointB = Vec3d(2, 2, 2);
        step.distances.push_back(pair);
    }
    step.contactsBegun = 2;
    step.counters.contactsLeftOut = 100;
    step.counters.eventsLeftOut = 7;
    step.counters.notLookedAt = 4;
    return step;
}

std::vector<std::uint64_t> firstObjects(const answer::PairEvents& told) {
    std::vector<std::uint64_t> ids;
    for (const PairEventValue& event : told.events) ids.push_back(event.objectA.value);
    return ids;
}

TEST(CollisionAnswers, ContactsComeWithWhatIsMissing) {
    const answer::Contacts told = contactsOf(someStep(), 12_frame, 5);
    EXPECT_EQ(std::tie(told.frame, told.begun, told.leftOut, told.notLookedAt), std::tuple(12_frame, 5u, 100u, 4u));
    ASSERT_EQ(told.contacts.size(), 1u);
    const ContactValue& c = told.contacts[0];
    EXPECT_EQ(std::tie(c.objectA, c.objectB, c.faceA, c.faceB, c.interest, c.time),
              std::tuple(ObjectId{1}, ObjectId{2}, 3u, ContactValue::kNoFace, ObjectId{9}, 0.25));
    EXPECT_EQ(c.point, Vec3d(1, 2, 3));
    EXPECT_EQ(c.normal, Vec3d::UnitZ());
}

TEST(CollisionAnswers, StaysAreToldToThoseWhoAskForThem) {
    using Ids = std::vector<std::uint64_t>;
    EXPECT_EQ(firstObjects(eventsOf(someStep(), 1_frame, true, 100)), (Ids{10, 11, 12, 13, 14, 15}));
    const answer::PairEvents changes = eventsOf(someStep(), 1_frame, false, 100);
    EXPECT_EQ(firstObjects(changes), (Ids{10, 12, 13, 15}));
    EXPECT_EQ(changes.leftOut, 7u) << "what nobody asked for is not left out";
    EXPECT_EQ(changes.events[0].phase, TouchPhase::kBegan);
    EXPECT_EQ(changes.events[1].phase, TouchPhase::kEnded);
    EXPECT_TRUE(changes.events[3].through);
    EXPECT_EQ(changes.events[3].firstTime, 0.5);
    EXPECT_EQ(changes.events[3].point, Vec3d(5, 0, 0));
    EXPECT_EQ(changes.events[3].objectB, ObjectId{25});
}

TEST(CollisionAnswers, ALimitLeavesOutStaysFirstAndCounts) {
    using Ids = std::vector<std::uint64_t>;
    const answer::PairEvents five = eventsOf(someStep(), 1_frame, true, 5);
    EXPECT_EQ(firstObjects(five), (Ids{10, 11, 12, 13, 15}));
    EXPECT_EQ(five.leftOut, 8u);
    const answer::PairEvents three = eventsOf(someStep(), 1_frame, true, 3);
    EXPECT_EQ(firstObjects(three), (Ids{10, 12, 13}));
    EXPECT_EQ(three.leftOut, 10u);
    EXPECT_TRUE(eventsOf(someStep(), 1_frame, true, 0).events.empty());
    EXPECT_EQ(eventsOf(someStep(), 1_frame, true, 0).leftOut, 13u);
    const answer::Distances two = distancesOf(someStep(), 1_frame, 2);
    ASSERT_EQ(two.distances.size(), 2u);
    EXPECT_EQ(two.leftOut, 8u);
    const PairDistanceValue& d = two.distances[1];
    EXPECT_EQ(std::tie(d.interest, d.objectA, d.objectB, d.phase, d.distance, d.nodeA, d.nodeB, d.faceA, d.faceB),
              std::tuple(ObjectId{8}, ObjectId{31}, ObjectId{40}, TouchPhase::kStays, 0.4, ObjectId{50}, ObjectId{51},
                         52u, 53u));
    EXPECT_EQ(d.error, 0.01);
    EXPECT_EQ(d.pointA, Vec3d(1, 1, 1));
    EXPECT_EQ(d.pointB, Vec3d(2, 2, 2));
}

TEST(CollisionAnswers, HostsAreToldTheNumbers) {
    const FrameCollision numbers = numbersOf(someStep());
    EXPECT_EQ(numbers, (FrameCollision{.contacts = 101, .begun = 2, .ended = 2, .near = 2, .nearest = 0.4}))
        << "a pair that is no longer near is not the nearest";
    EXPECT_EQ(numbersOf({}), FrameCollision());
}

/// The limits of the desk and of the codec are one contract: what is told can be heard.
TEST(CollisionAnswers, TheMostThatIsToldFitsIntoANotice) {
    const FrameNews::Limits limits;
    StepResult full;
    full.contacts = std::vector<Contact>(CollisionLimits().maxContacts);
    full.events = std::vector<PairEvent>(CollisionLimits().maxEvents);
    full.distances = std::vector<PairDistance>(CollisionLimits().maxEvents);
    EXPECT_TRUE(decodeNotice(encodeNotice(contactsOf(full, 0_frame, 0))));
    EXPECT_TRUE(decodeNotice(encodeNotice(eventsOf(full, 0_frame, true, limits.maxEventsTold))));
    EXPECT_TRUE(decodeNotice(encodeNotice(distancesOf(full, 0_frame, limits.maxDistancesTold))));
    answer::Questions questions;
    questions.questions.resize(CollisionLimits().maxQuestions);
    questions.closed.resize(CollisionLimits().maxQuestions);
    EXPECT_TRUE(decodeNotice(encodeNotice(questions)));
}

}  // namespace
}  // namespace tessera
