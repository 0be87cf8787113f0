#include "server/sim/recording/RecordingDigest.h"

#include <bit>

#include <fmt/format.h>

#include "common/base/Hash.h"

namespace tessera {
namespace {

constexpr std::array<std::string_view, kDigestParts> kPartNames{
    "outcomes of edits", "accepted transforms", "velocities",    "stopped transforms", "contacts", "events",
    "distances",         "questions",           "not looked at", "the committed list"};
constexpr std::array<std::string_view, kDigestCounters> kCounterNames{
    "contacts begun",    "objects",         "skipped objects",     "free bodies",    "sleeping bodies",
    "neighbours",        "pairs tested",    "box tests",           "triangle tests", "pairs not looked at",
    "contacts left out", "events left out", "unanswered questions"};

/// Numbers one after the other, as their bits. The bindings below name every member, so that a new one does not compile
/// until it is here.
class Bits {
public:
    void add(std::uint64_t v) { words_.push_back(v); }
    void add(double v) { add(std::bit_cast<std::uint64_t>(v)); }
    void add(ObjectId v) { add(v.value); }
    void add(const Vec2d& v) { addAll(v.x(), v.y()); }
    void add(const Vec3d& v) {
        for (int i = 0; i < 3; ++i) add(v[i]);
    }
    void add(const Quatd& q) {
        for (const double v : {q.w(), q.x(), q.y(), q.z()}) add(v);
    }
    void add(const Pose& p) { addAll(p.translation, p.rotation, p.scale); }
    template <typename Enum>
    requires std::is_enum_v<Enum>
    void add(Enum v) { add(static_cast<std::uint64_t>(v)); }
    void add(bool v) { add(std::uint64_t{v}); }
    void add(int v) { add(static_cast<std::uint64_t>(v)); }
    void add(std::uint32_t v) { add(std::uint64_t{v}); }
    template <typename... Values>
    void addAll(const Values&... values) {
        (add(values), ...);
    }

    void add(const EditOutcome& o) {
        const auto& [ticket, result, underWay] = o;
        // (What is in the answer beside these the desk says, and the frame, whose sequence stands in the digest.)
        static const answer::Committed kNothing;
        const auto& [sequence, ids, stopped, removed, created] = result ? *result : kNothing;
        addAll(ticket, result ? std::uint64_t{0} : 1 + static_cast<std::uint64_t>(result.error().code),
               std::uint64_t{ids.size()});
        for (const auto& [placeholder, id] : ids) addAll(placeholder, id);
        add(std::uint64_t{stopped.size()});
        for (const ObjectId id : stopped) add(id);
        add(underWay);
    }
    void add(const TentativeTransform& t) {
        const auto& [transform, translation, rotation, scale, source] = t;
        addAll(transform, translation, rotation, scale, source);
    }
    void add(const BodyVelocity& v) {
        const auto& [core, velocity, spin] = v;
        addAll(core, velocity, spin);
    }
    void add(const Contact& c) {
        const auto& [objectA, objectB, faceA, faceB, point, normal, depth, uvA, uvB, patchA, patchB, patchUvA, patchUvB,
                     error, interest, time] = c;
        addAll(objectA, objectB, faceA, faceB, point, normal, depth, uvA, uvB, error, interest, time);
        // Of what is not smooth nothing, as before there were patches: recordings of then are still repeated.
        if (patchA != Contact::kNoFace) addAll(patchA, patchUvA);
        if (patchB != Contact::kNoFace) addAll(patchB, patchUvB);
    }
    void add(const PairEvent& e) {
        const auto& [interest, objectA, objectB, phase, firstTime, point, normal, through] = e;
        addAll(interest, objectA, objectB, phase, firstTime, point, normal, through);
    }
    void add(const PairDistance& d) {
        const auto& [interest, objectA, objectB, phase, distance, nodeA, nodeB, faceA, faceB, pointA, pointB, error] =
            d;
        addAll(interest, objectA, objectB, phase, distance, nodeA, nodeB, faceA, faceB, pointA, pointB, error);
    }
    void add(const Question& q) {
        const auto& [id, interest, objectA, objectB, transform, present, wanted, point, normal] = q;
        addAll(id, interest, objectA, objectB, transform, present, wanted, point, normal);
    }
    void add(const NotLookedAt& n) {
        const auto& [nodeA, nodeB, reason] = n;
        addAll(nodeA, nodeB, reason);
    }

    [[nodiscard]] std::uint64_t hash() const { return hash64(std::as_bytes(std::span(words_))); }

private:
    std::vector<std::uint64_t> words_;
};

template <typename Item>
FrameDigest::Part partOf(const std::vector<Item>& items) {
    Bits bits;
    for (const Item& item : items) bits.add(item);
    return {.count = items.size(), .hash = bits.hash()};
}

}  // namespace

FrameDigest digestOf(const FrameResult& frame) {
    const auto& [accepted, velocities, stopped, contacts, events, distances, questions, contactsBegun, notLookedAt,
                 standIns, counters] = frame.collision;
    FrameDigest digest{.sequence = frame.commit.sent->sequence, .stateHash = frame.commit.sent->stateHash};
    const auto at = [&](DigestPart part) -> FrameDigest::Part& { return digest.parts[static_cast<std::size_t>(part)]; };
    at(DigestPart::kOutcomes) = partOf(frame.outcomes);
    at(DigestPart::kAccepted) = partOf(accepted);
    at(DigestPart::kVelocities) = partOf(velocities);
    at(DigestPart::kStopped) = partOf(stopped);
    at(DigestPart::kContacts) = partOf(contacts.all());
    at(DigestPart::kEvents) = partOf(events.all());
    at(DigestPart::kDistances) = partOf(distances.all());
    at(DigestPart::kQuestions) = partOf(questions);
    at(DigestPart::kNotLookedAt) = partOf(notLookedAt);
    at(DigestPart::kChanges) = {.count = frame.commit.list ? frame.commit.list->changeCount() : 0,
                                .hash = frame.commit.sent->changed() ? hash64(frame.commit.sent->encoded) : 0};

    // (How many bodies were handed over is no result; what stands in for what follows from the scene.)
    const auto& [objects, skipped, freeBodies, asleep, handedOver, neighbours, pairsTested, boxTests, triangleTests,
                 leftUndecided, contactsLeftOut, eventsLeftOut, unanswered, standInCount] = counters;
    digest.counters = {contactsBegun,   objects,       skipped,   freeBodies,    asleep,
                       neighbours,      pairsTested,   boxTests,  triangleTests, leftUndecided,
                       contactsLeftOut, eventsLeftOut, unanswered};
    return digest;
}

std::vector<std::string> differences(const FrameDigest& recorded, const FrameDigest& now) {
    std::vector<std::string> words;
    for (std::size_t i = 0; i < kDigestParts; ++i) {
        const FrameDigest::Part &then = recorded.parts[i], &here = now.parts[i];
        if (then != here)
            words.push_back(fmt::format("{}: recorded {} ({}), now {} ({})", kPartNames[i], then.count,
                                        toHex(then.hash), here.count, toHex(here.hash)));
    }
    if (recorded.sequence != now.sequence)
        words.push_back(fmt::format("sequence: recorded {}, now {}", recorded.sequence.value, now.sequence.value));
    if (recorded.stateHash != now.stateHash)
        words.push_back(
            fmt::format("state hash: recorded {}, now {}", toHex(recorded.stateHash), toHex(now.stateHash)));
    for (std::size_t i = 0; i < kDigestCounters; ++i)
        if (recorded.counters[i] != now.counters[i])
            words.push_back(
                fmt::format("{}: recorded {}, now {}", kCounterNames[i], recorded.counters[i], now.counters[i]));
    return words;
}

std::uint64_t digestOf(const CollisionLimits& limits) {
    const auto& [maxContacts, maxEvents, maxInterests, maxNotLookedAt, maxQuestions, maxTests, stopTolerance] = limits;
    Bits bits;
    bits.addAll(maxContacts, maxEvents, maxInterests, maxNotLookedAt, maxQuestions, maxTests, stopTolerance);
    return bits.hash();
}

}  // namespace tessera
