/// What applications are told of collisions: every field arrives as it was said, and bytes that say what cannot be are
/// refused.
#include "common/codec/RecordCodec.h"
#include "common/request/Check.h"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <random>

#include "common/codec/ApplicationCodec.h"
#include "tests/unit/HistoryLiterals.h"

namespace tessera {
namespace {

ContactValue someContact() {
    return {.objectA = ObjectId{1},
            .objectB = ObjectId{~0ull},
            .faceA = 3,
            .faceB = ContactValue::kNoFace,
            .point = Vec3d(0.1, -2, 1e300),
            .normal = Vec3d(0, 0.6, 0.8),
            .depth = 0.25,
            .uvA = Vec2d(0.5, 0.125),
            .uvB = Vec2d(0, 1),
            .patchA = 7,
            .patchB = ContactValue::kNoFace,
            .patchUvA = Vec2d(-1.5, 1e6),
            .patchUvB = Vec2d::Zero(),
            .error = 0.001,
            .interest = ObjectId{9},
            .time = 0.3};
}
PairEventValue someEvent() {
    return {.interest = ObjectId{11},
            .objectA = ObjectId{12},
            .objectB = ObjectId{13},
            .phase = TouchPhase::kEnded,
            .firstTime = 0.1,
            .point = Vec3d(1, 2, 3),
            .normal = Vec3d(-1, 0, 0),
            .through = true};
}
PairDistanceValue someDistance() {
    return {.interest = ObjectId{21},
            .objectA = ObjectId{22},
            .objectB = ObjectId{23},
            .phase = TouchPhase::kStays,
            .distance = 0.7,
            .nodeA = ObjectId{24},
            .nodeB = ObjectId{25},
            .faceA = 26,
            .faceB = 27,
            .pointA = Vec3d(28, 29, 30),
            .pointB = Vec3d(31, 32, 33),
            .error = 0.01};
}
QuestionValue someQuestion() {
    return {.id = 41,
            .interest = ObjectId{42},
            .objectA = ObjectId{43},
            .objectB = ObjectId{44},
            .transform = ObjectId{45},
            .present = {Vec3d(1, 2, 3), Quatd(0.5, -0.5, 0.5, 0.5), Vec3d(4, 5, 6)},
            .wanted = {Vec3d(7, 8, 9), Quatd(0, 0, 0.6, 0.8), Vec3d(-1, 1, 2)},
            .point = Vec3d(10, 11, 12),
            .normal = Vec3d(0, 0, -1)};
}

void expectSame(const ContactValue& a, const ContactValue& b) {
    EXPECT_EQ(std::tie(a.objectA, a.objectB, a.faceA, a.faceB, a.interest, a.time),
              std::tie(b.objectA, b.objectB, b.faceA, b.faceB, b.interest, b.time));
    EXPECT_EQ(a.point, b.point);
    EXPECT_EQ(a.normal, b.normal);
    EXPECT_EQ(std::tie(a.depth, a.error), std::tie(b.depth, b.error));
    EXPECT_EQ(a.uvA, b.uvA);
    EXPECT_EQ(a.uvB, b.uvB);
    EXPECT_EQ(a.patchA, b.patchA);
    EXPECT_EQ(a.patchB, b.patchB);
    EXPECT_EQ(a.patchUvA, b.patchUvA);
    EXPECT_EQ(a.patchUvB, b.patchUvB);
}
void expectSame(const PairEventValue& a, const PairEventValue& b) {
    EXPECT_EQ(std::tie(a.interest, a.objectA, a.objectB, a.phase, a.firstTime, a.through),
              std::tie(b.interest, b.objectA, b.objectB, b.phase, b.firstTime, b.through));
    EXPECT_EQ(a.point, b.point);
    EXPECT_EQ(a.normal, b.normal);
}
void expectSame(const PairDistanceValue& a, const PairDistanceValue& b) {
    EXPECT_EQ(
        std::tie(a.interest, a.objectA, a.objectB, a.phase, a.distance, a.error, a.nodeA, a.nodeB, a.faceA, a.faceB),
        std::tie(b.interest, b.objectA, b.objectB, b.phase, b.distance, b.error, b.nodeA, b.nodeB, b.faceA, b.faceB));
    EXPECT_EQ(a.pointA, b.pointA);
    EXPECT_EQ(a.pointB, b.pointB);
}
void expectSame(const Pose& a, const Pose& b) {
    EXPECT_EQ(a.translation, b.translation);
    EXPECT_EQ(a.rotation.coeffs(), b.rotation.coeffs());
    EXPECT_EQ(a.scale, b.scale);
}
void expectSame(const QuestionValue& a, const QuestionValue& b) {
    EXPECT_EQ(std::tie(a.id, a.interest, a.objectA, a.objectB, a.transform),
              std::tie(b.id, b.interest, b.objectA, b.objectB, b.transform));
    expectSame(a.present, b.present);
    expectSame(a.wanted, b.wanted);
    EXPECT_EQ(a.point, b.point);
    EXPECT_EQ(a.normal, b.normal);
}

/// Said as an answer and as a notice, and heard.
template <typename Told>
std::vector<Told> heard(const Told& told) {
    std::vector<Told> both;
    const auto answer = decodeAnswer(encodeAnswer(told));
    const auto notice = decodeNotice(encodeNotice(told));
    EXPECT_TRUE(answer && notice);
    if (answer) both.push_back(std::get<Told>(*answer));
    if (notice) both.push_back(std::get<Told>(*notice));
    return both;
}

TEST(ApplicationCollision, ContactsKeepInterestAndTimeAndWhatWasLeftOut) {
    for (const auto& told : heard(answer::Contacts{100_frame, 7, {someContact(), {}}, 8, 9})) {
        EXPECT_EQ(std::tie(told.frame, told.begun, told.leftOut, told.notLookedAt), std::tuple(100_frame, 7u, 8u, 9u));
        ASSERT_EQ(told.contacts.size(), 2u);
        expectSame(told.contacts[0], someContact());
        expectSame(told.contacts[1], {});
    }
}

TEST(ApplicationCollision, EventsDistancesAndQuestionsKeepTheirFields) {
    for (const auto& told : heard(answer::PairEvents{101_frame, {{}, someEvent()}, 5})) {
        EXPECT_EQ(std::tie(told.frame, told.leftOut), std::tuple(101_frame, 5u));
        ASSERT_EQ(told.events.size(), 2u);
        expectSame(told.events[1], someEvent());
    }
    for (const auto& told : heard(answer::Distances{102_frame, {someDistance(), {}}, 6})) {
        EXPECT_EQ(std::tie(told.frame, told.leftOut), std::tuple(102_frame, 6u));
        ASSERT_EQ(told.distances.size(), 2u);
        expectSame(told.distances[0], someDistance());
    }
    for (const auto& told : heard(answer::Questions{103_frame, {someQuestion(), {}}, {3, 5, ~0ull}, 2})) {
        EXPECT_EQ(std::tie(told.frame, told.unanswered), std::tuple(103_frame, 2u));
        ASSERT_EQ(told.questions.size(), 2u);
        expectSame(told.questions[0], someQuestion());
        EXPECT_EQ(told.closed, (std::vector<std::uint64_t>{3, 5, ~0ull}));
    }
}

TEST(ApplicationCollision, SubscriptionsAndDecisionsKeepTheirFields) {
    for (int bit = 0; bit < 7; ++bit) {
        const Subscription wanted{bit == 0, bit == 1, bit == 2, bit == 3, bit == 4, bit == 5, bit == 6};
        const auto back =
            std::get<request::SubscribeNews>(*decodeRequest(encodeRequest(request::SubscribeNews{wanted}))).wanted;
        EXPECT_EQ(
            std::tie(back.contacts, back.picks, back.frames, back.events, back.stays, back.distances, back.questions),
            std::tie(wanted.contacts, wanted.picks, wanted.frames, wanted.events, wanted.stays, wanted.distances,
                     wanted.questions))
            << bit;
    }
    using Decision = QuestionReply::Decision;
    for (const Decision decision : {Decision::kStop, Decision::kPass, Decision::kMove}) {
        QuestionReply respond{.question = 12, .decision = decision, .pose = someQuestion().wanted};
        const auto back =
            std::get<request::AnswerQuestion>(*decodeRequest(encodeRequest(request::AnswerQuestion{respond}))).reply;
        EXPECT_EQ(back.question, 12u);
        EXPECT_EQ(back.decision, decision);
        expectSame(back.pose, decision == Decision::kMove ? respond.pose : Pose());
    }
}

TEST(ApplicationCollision, DecisionsThatCannotBeAreRefused) {
    QuestionReply respond{.question = 1, .decision = QuestionReply::Decision::kMove, .pose = {}};
    const auto refused = [&] { return !decodeRequest(encodeRequest(request::AnswerQuestion{respond})); };
    EXPECT_FALSE(refused());
    respond.pose.translation.z() = std::numeric_limits<double>::quiet_NaN();
    EXPECT_TRUE(refused());
    respond.pose = {};
    respond.pose.rotation = Quatd(0, 0, 0, 0);
    EXPECT_TRUE(refused());
    respond.pose = {};
    respond.pose.scale.y() = 0;
    EXPECT_TRUE(refused());
    respond = {.question = 1, .decision = static_cast<QuestionReply::Decision>(3), .pose = {}};
    EXPECT_TRUE(refused());
}

template <typename Value>
Bytes packed(const std::vector<Value>& values) {
    return packRecords(descriptionOf<Value>(), values.data(), values.size()).bytes;
}
struct HoldsRecords {
    template <typename Value>
    static Holder of() {
        return {[](const void* all) { return static_cast<const std::vector<Value>*>(all)->size(); },
                [](const void* all) -> const void* { return static_cast<const std::vector<Value>*>(all)->data(); },
                [](void* all, std::size_t size) { static_cast<std::vector<Value>*>(all)->resize(size); }};
    }
};
/// As a message would: records, and whether each says what may be.
template <typename Value>
Expected<std::vector<Value>> unpacked(ByteSpan bytes, std::size_t most) {
    const Description& description = descriptionOf<Value>();
    std::vector<Value> values;
    if (const auto taken = unpackRecords(description, bytes, most, {}, HoldsRecords::of<Value>(), &values); !taken)
        return tl::unexpected(taken.error());
    for (const Value& value : values)
        if (const std::optional<Error> fault = findFault(description, &value)) return tl::unexpected(*fault);
    return values;
}

/// One entry, one thing wrong with it.
template <typename Value, typename Spoil>
bool refused(Value value, Spoil spoil) {
    spoil(value);
    return !unpacked<Value>(packed<Value>({value}), 1);
}

TEST(ApplicationCollision, NumbersThatCannotBeAreRefused) {
    const double nan = std::numeric_limits<double>::quiet_NaN(), infinite = std::numeric_limits<double>::infinity();
    EXPECT_FALSE(refused(someContact(), [](auto&) {}));
    EXPECT_TRUE(refused(someContact(), [&](auto& c) { c.point.x() = nan; }));
    EXPECT_TRUE(refused(someContact(), [&](auto& c) { c.normal.z() = infinite; }));
    EXPECT_TRUE(refused(someContact(), [&](auto& c) { c.time = -0.1; }));
    EXPECT_TRUE(refused(someContact(), [&](auto& c) { c.time = 1.1; }));
    EXPECT_TRUE(refused(someContact(), [&](auto& c) { c.patchUvA.x() = nan; }));
    EXPECT_TRUE(refused(someContact(), [&](auto& c) { c.patchUvB.y() = infinite; }));
    EXPECT_FALSE(refused(someEvent(), [](auto&) {}));
    EXPECT_TRUE(refused(someEvent(), [&](auto& e) { e.firstTime = nan; }));
    EXPECT_TRUE(refused(someEvent(), [&](auto& e) { e.firstTime = 2; }));
    EXPECT_TRUE(refused(someEvent(), [&](auto& e) { e.point.y() = -infinite; }));
    EXPECT_TRUE(refused(someEvent(), [&](auto& e) { e.phase = static_cast<TouchPhase>(3); }));
    EXPECT_FALSE(refused(someDistance(), [](auto&) {}));
    EXPECT_TRUE(refused(someDistance(), [&](auto& d) { d.distance = -1e-300; }));
    EXPECT_TRUE(refused(someDistance(), [&](auto& d) { d.distance = infinite; }));
    EXPECT_TRUE(refused(someDistance(), [&](auto& d) { d.pointB.x() = nan; }));
    EXPECT_TRUE(refused(someDistance(), [&](auto& d) { d.phase = static_cast<TouchPhase>(200); }));
    EXPECT_FALSE(refused(someQuestion(), [](auto&) {}));
    EXPECT_TRUE(refused(someQuestion(), [&](auto& q) { q.present.rotation = Quatd(0, 0, 0, 0); }));
    EXPECT_TRUE(refused(someQuestion(), [&](auto& q) { q.wanted.scale.x() = nan; }));
    EXPECT_TRUE(refused(someQuestion(), [&](auto& q) { q.normal.x() = nan; }));

    const PairEventValue event = someEvent();
    Bytes flag = packed<PairEventValue>({event});
    flag[28] = std::byte{2};  // `through`
    EXPECT_FALSE(unpacked<PairEventValue>(flag, 1));
    const PairDistanceValue distance = someDistance();
    Bytes reserved = packed<PairDistanceValue>({distance});
    reserved[52] = std::byte{1};
    EXPECT_FALSE(unpacked<PairDistanceValue>(reserved, 1));
}

TEST(ApplicationCollision, CountsAndBytesAreBounded) {
    const std::vector<PairEventValue> events(3, someEvent());
    const Bytes bytes = packed(events);
    EXPECT_TRUE(unpacked<PairEventValue>(bytes, 3));
    EXPECT_EQ(unpacked<PairEventValue>(bytes, 2).error().code, ErrorCode::kLimit);
    EXPECT_FALSE(unpacked<PairEventValue>(ByteSpan(bytes).first(bytes.size() - 1), 3))
        << "cut in the middle of an entry";

    ApplicationLimits tight;
    tight.maxEvents = tight.maxDistances = tight.maxQuestions = tight.maxContacts = 1;
    EXPECT_EQ(decodeNotice(encodeNotice(answer::PairEvents{0_frame, events, 0}), tight).error().code,
              ErrorCode::kLimit);
    EXPECT_FALSE(decodeNotice(encodeNotice(answer::Distances{0_frame, {{}, {}}, 0}), tight));
    EXPECT_FALSE(decodeNotice(encodeNotice(answer::Questions{0_frame, {{}, {}}, {}, 0}), tight));
    EXPECT_FALSE(decodeNotice(encodeNotice(answer::Questions{0_frame, {}, {1, 2}, 0}), tight));
    EXPECT_FALSE(decodeNotice(encodeNotice(answer::Contacts{0_frame, 0, {{}, {}}, 0, 0}), tight));

    ApplicationLimits small;
    small.maxCollisionBytes = 3 * descriptionOf<PairEventValue>().recordBytes - 1;
    EXPECT_EQ(decodeNotice(encodeNotice(answer::PairEvents{0_frame, events, 0}), small).error().code,
              ErrorCode::kLimit);
    small.maxCollisionBytes = 3 * descriptionOf<PairEventValue>().recordBytes;
    EXPECT_TRUE(decodeNotice(encodeNotice(answer::PairEvents{0_frame, events, 0}), small));
}

/// Damaged records: refused, or every value is one that may be.
TEST(ApplicationCollision, NoBytesCrashIt) {
    const std::vector<ContactValue> contacts(4, someContact());
    const std::vector<PairEventValue> events(4, someEvent());
    const std::vector<PairDistanceValue> distances(4, someDistance());
    const std::vector<QuestionValue> questions(4, someQuestion());
    const std::array seeds{packed(contacts), packed(events), packed(distances), packed(questions)};
    std::mt19937 random(11);
    std::size_t accepted = 0, refusedOnes = 0;
    for (int round = 0; round < 20'000; ++round) {
        Bytes bytes = seeds[random() % seeds.size()];
        for (unsigned n = random() % 4; n > 0; --n) bytes[random() % bytes.size()] = static_cast<std::byte>(random());
        if (random() % 4 == 0) bytes.resize(random() % (bytes.size() + 1));
        if (const auto found = unpacked<ContactValue>(bytes, 8)) {
            ++accepted;
            for (const ContactValue& c : *found) EXPECT_TRUE(c.point.allFinite() && c.time >= 0 && c.time <= 1);
        } else {
            ++refusedOnes;
        }
        if (const auto found = unpacked<PairEventValue>(bytes, 8)) {
            ++accepted;
            for (const PairEventValue& e : *found) EXPECT_LE(e.phase, TouchPhase::kEnded);
        }
        if (const auto found = unpacked<PairDistanceValue>(bytes, 8)) {
            ++accepted;
            for (const PairDistanceValue& d : *found) EXPECT_TRUE(d.distance >= 0 && std::isfinite(d.distance));
        }
        if (const auto found = unpacked<QuestionValue>(bytes, 8)) {
            ++accepted;
            for (const QuestionValue& q : *found) EXPECT_GT(q.wanted.rotation.squaredNorm(), 0);
        }
    }
    EXPECT_GT(accepted, 5000u);
    EXPECT_GT(refusedOnes, 5000u);
}

}  // namespace
}  // namespace tessera
