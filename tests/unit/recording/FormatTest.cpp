/// Records to bytes and back.
#include "server/sim/recording/RecordingFormat.h"

#include <gtest/gtest.h>

#include <bit>
#include <limits>

#include "tests/unit/recording/RecordFile.h"

namespace tessera {
namespace {

template <typename T>
T roundTrip(const RecordContent& content, const BlobStore& arrays = {}) {
    const test::RawRecord raw = test::rawOf(content);
    Expected<Record> record = decodeRecord(raw.kind, raw.content, arrays);
    if (!record) throw std::runtime_error(record.error().message);
    return std::get<T>(std::move(*record));
}

TEST(RecordingFormat, KeepsInputsToTheLastBit) {
    test::ListMaker make;
    const ObjectId box = make.box(Vec3d(1, 2, 3));
    make.node("box", kRootNode, box);
    const ChangeList list = make.builder.take();
    BlobStore arrays;
    for (const Blob& blob : blobsOf(list)) arrays.add(blob);
    const double nan = std::bit_cast<double>(std::uint64_t{0x7ff8000000001234});
    const std::vector<Edit> edits{
        {.ticket = ~std::uint64_t{0}, .list = list, .undoable = false, .gesture = {7, 8}},
        {.ticket = 2, .list = list, .kind = Edit::Kind::kRedo, .undoable = true},
        {.ticket = 3, .list = list, .kind = Edit::Kind::kLastPart, .objects = 70'000},
        {.ticket = 4, .move = NodeMove{.translation = Vec3d(nan, -0.0, 1), .relative = true}, .node = ObjectId(9)},
        {.ticket = 5, .move = NodeMove{.rotation = Quatd(1, 2, 3, 4), .scale = Vec3d(5, 6, 7)}, .node = ObjectId(10)}};
    const std::vector<Reply> replies{{.question = 17,
                                      .decision = Reply::Decision::kMove,
                                      .pose = {.translation = Vec3d(nan, -0.0, 1e-308),
                                               .rotation = Quatd(1, 2, 3, 4),
                                               .scale = Vec3d(5, std::numeric_limits<double>::infinity(), 7)}}};
    const auto back = roundTrip<record::Inputs>(encodeInputs(FrameNumber(12), true, edits, replies), arrays);
    EXPECT_EQ(back.frame, FrameNumber(12));
    EXPECT_TRUE(back.first);
    ASSERT_EQ(back.edits.size(), 5u);
    EXPECT_FALSE(back.edits[2].move);
    ASSERT_TRUE(back.edits[3].move && back.edits[4].move);
    const NodeMove &by = *back.edits[3].move, &to = *back.edits[4].move;
    EXPECT_EQ(back.edits[3].node, ObjectId(9));
    EXPECT_EQ(std::bit_cast<std::uint64_t>(by.translation->x()), std::bit_cast<std::uint64_t>(nan));
    EXPECT_TRUE(by.relative && !by.rotation && !by.scale);
    EXPECT_EQ(back.edits[4].node, ObjectId(10));
    EXPECT_TRUE(!to.relative && !to.translation);
    EXPECT_EQ(to.rotation->coeffs(), Quatd(1, 2, 3, 4).coeffs());
    EXPECT_EQ(*to.scale, Vec3d(5, 6, 7));
    EXPECT_EQ(back.edits[0].ticket, ~std::uint64_t{0});
    EXPECT_EQ(back.edits[0].list, list);
    EXPECT_EQ(back.edits[0].kind, Edit::Kind::kChange);
    EXPECT_EQ(back.edits[0].gesture, (Gesture{7, 8}));
    EXPECT_FALSE(back.edits[0].undoable);
    EXPECT_EQ(back.edits[1].kind, Edit::Kind::kRedo);
    EXPECT_TRUE(back.edits[1].undoable);
    EXPECT_TRUE(back.edits[1].list.empty()) << "an undo's list is nobody's business";
    EXPECT_EQ(back.edits[2].kind, Edit::Kind::kLastPart);
    EXPECT_EQ(back.edits[2].objects, 70'000u);
    EXPECT_EQ(back.edits[2].list, list);
    ASSERT_EQ(back.replies.size(), 1u);
    EXPECT_EQ(back.replies[0].question, 17u);
    EXPECT_EQ(back.replies[0].decision, Reply::Decision::kMove);
    for (int i = 0; i < 3; ++i) {
        EXPECT_EQ(std::bit_cast<std::uint64_t>(back.replies[0].pose.translation[i]),
                  std::bit_cast<std::uint64_t>(replies[0].pose.translation[i]));
        EXPECT_EQ(back.replies[0].pose.scale[i], replies[0].pose.scale[i]);
    }
    EXPECT_EQ(back.replies[0].pose.rotation.coeffs(), replies[0].pose.rotation.coeffs());
}

TEST(RecordingFormat, KeepsOpeningsAndOutcomes) {
    record::Opening opening = test::openingForTests();
    opening.threads = 7;
    opening.limits = {.maxObjects = 11, .maxChildren = 12, .maxDepth = 13, .maxTextBytes = 14};
    const auto back = roundTrip<record::Opening>(encodeOpening(opening));
    EXPECT_EQ(back.schema, opening.schema);
    EXPECT_EQ(back.program, opening.program);
    EXPECT_EQ(back.threads, 7u);
    EXPECT_EQ(back.limits.maxObjects, 11u);
    EXPECT_EQ(back.limits.maxTextBytes, 14u);
    EXPECT_EQ(back.collisionLimits, digestOf(CollisionLimits()));

    Random random(1);
    record::Outcome outcome{.frame = FrameNumber(99), .digest = {}};
    outcome.digest.sequence = Sequence(random());
    outcome.digest.stateHash = StateHash(random());
    for (FrameDigest::Part& part : outcome.digest.parts) part = {.count = random(), .hash = random()};
    for (std::uint64_t& counter : outcome.digest.counters) counter = random();
    const auto same = roundTrip<record::Outcome>(encodeOutcome(outcome));
    EXPECT_EQ(same.frame, FrameNumber(99));
    EXPECT_EQ(same.digest, outcome.digest);
}

TEST(RecordingFormat, RefusesDecisionsAndFlagsThatAreNone) {
    const std::vector<Reply> replies{{.question = 1, .decision = static_cast<Reply::Decision>(9), .pose = {}}};
    const test::RawRecord raw = test::rawOf(encodeInputs(FrameNumber(0), true, {}, replies));
    const BlobStore none;
    EXPECT_EQ(decodeRecord(raw.kind, raw.content, none).error().message, "reply: decision 9 is none");
    const std::vector<Edit> three(3);
    const test::RawRecord many = test::rawOf(encodeInputs(FrameNumber(0), true, three, {}));
    EXPECT_EQ(decodeRecord(many.kind, many.content, none, {.maxEdits = 2}).error().code, ErrorCode::kLimit);
}

/// Everything in a result is in its digest: whatever is changed shows.
TEST(FrameDigest, SeesEveryMember) {
    const auto filled = [] {
        FrameResult frame;
        frame.outcomes.push_back(
            {.ticket = 1, .result = answer::Committed{.ids = {{ObjectId{1}, ObjectId{2}}}, .stopped = {ObjectId{3}}}});
        frame.collision.accepted.push_back({.transform = ObjectId{4}});
        frame.collision.velocities.push_back({.core = ObjectId{5}});
        frame.collision.stopped = {ObjectId{6}};
        frame.collision.contacts.push_back({.objectA = ObjectId{7}, .objectB = ObjectId{8}});
        frame.collision.events.push_back({.interest = ObjectId{9}});
        frame.collision.distances.push_back({.interest = ObjectId{10}});
        frame.collision.questions.push_back({.id = 11});
        frame.collision.notLookedAt.push_back({.nodeA = ObjectId{12}});
        return frame;
    };
    const std::vector<std::pair<const char*, std::function<void(FrameResult&)>>> changes{
        {"outcomes of edits", [](FrameResult& f) { f.outcomes[0].result = fail(ErrorCode::kRefused, "no"); }},
        {"outcomes of edits", [](FrameResult& f) { f.outcomes[0].result->ids[0].second = ObjectId{99}; }},
        {"outcomes of edits", [](FrameResult& f) { f.outcomes[0].result->stopped.clear(); }},
        {"accepted transforms", [](FrameResult& f) { f.collision.accepted[0].rotation.w() = 0.5; }},
        {"velocities", [](FrameResult& f) { f.collision.velocities[0].spin.z() = 1e-300; }},
        {"stopped transforms", [](FrameResult& f) { f.collision.stopped.push_back(ObjectId{7}); }},
        {"contacts", [](FrameResult& f) { f.collision.contacts[0].faceB = 1; }},
        {"contacts", [](FrameResult& f) { f.collision.contacts[0].normal.y() = -0.0; }},
        {"contacts",
         [](FrameResult& f) { std::swap(f.collision.contacts[0].objectA, f.collision.contacts[0].objectB); }},
        {"events", [](FrameResult& f) { f.collision.events[0].phase = Phase::kEnded; }},
        {"events", [](FrameResult& f) { f.collision.events[0].through = true; }},
        {"distances", [](FrameResult& f) { f.collision.distances[0].pointB.x() = 3; }},
        {"questions", [](FrameResult& f) { f.collision.questions[0].wanted.scale.x() = 3; }},
        {"not looked at", [](FrameResult& f) { f.collision.notLookedAt[0].reason = NotLookedAt::Reason::kNotFinite; }},
        {"the committed list",
         [](FrameResult& f) {
             f.commit.sent = share(CommittedList{{}, {}, Bytes(3), {}});
         }},
        {"sequence",
         [](FrameResult& f) {
             f.commit.sent = share(CommittedList{Sequence(1), {}, {}, {}});
         }},
        {"state hash",
         [](FrameResult& f) {
             f.commit.sent = share(CommittedList{{}, StateHash(1), {}, {}});
         }},
        {"contacts begun", [](FrameResult& f) { ++f.collision.contactsBegun; }},
        {"free bodies", [](FrameResult& f) { ++f.collision.counters.freeBodies; }},
        {"unanswered questions", [](FrameResult& f) { ++f.collision.counters.unanswered; }}};
    const FrameDigest plain = digestOf(filled());
    EXPECT_TRUE(differences(plain, digestOf(filled())).empty());
    for (const auto& [name, change] : changes) {
        FrameResult other = filled();
        change(other);
        const std::vector<std::string> words = differences(plain, digestOf(other));
        ASSERT_EQ(words.size(), 1u) << name;
        EXPECT_EQ(words[0].rfind(std::string(name) + ": recorded ", 0), 0u) << words[0];
    }
}

}  // namespace
}  // namespace tessera
