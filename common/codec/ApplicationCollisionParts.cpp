#include "common/codec/ApplicationCollisionParts.h"

#include <bit>
#include <cmath>

#include "common/codec/Parts.h"

namespace tessera {

namespace {

/// The bits of doubles: records are compared and copied as integers.
using Bits = std::uint64_t;
struct Bits2 {
    Bits x, y;
};
struct Bits3 {
    Bits x, y, z;
};
struct PoseBits {
    Bits3 translation;
    Bits w, x, y, z;
    Bits3 scale;
};

struct ContactRecord {
    std::uint64_t objectA, objectB;
    std::uint32_t faceA, faceB;
    Bits3 point, normal;
    Bits depth, error;
    Bits2 uvA, uvB;
    std::uint64_t interest;
    Bits time;
    std::uint32_t patchA, patchB;
    Bits2 patchUvA, patchUvB;
};
struct PairEventRecord {
    std::uint64_t interest, objectA, objectB;
    std::uint32_t phase, through;
    Bits firstTime;
    Bits3 point, normal;
};
struct PairDistanceRecord {
    std::uint64_t interest, objectA, objectB, nodeA, nodeB;
    std::uint32_t faceA, faceB, phase, reserved;
    Bits distance, error;
    Bits3 pointA, pointB;
};
struct QuestionRecord {
    std::uint64_t id, interest, objectA, objectB, transform;
    PoseBits present, wanted;
    Bits3 point, normal;
};
static_assert(sizeof(ContactRecord) == kContactBytes && sizeof(PairEventRecord) == kPairEventBytes);
static_assert(sizeof(PairDistanceRecord) == kPairDistanceBytes && sizeof(QuestionRecord) == kQuestionBytes);

Bits bitsOf(double value) {
    return std::bit_cast<Bits>(value);
}
Bits2 bitsOf(const Vec2d& v) {
    return {bitsOf(v.x()), bitsOf(v.y())};
}
Bits3 bitsOf(const Vec3d& v) {
    return {bitsOf(v.x()), bitsOf(v.y()), bitsOf(v.z())};
}
PoseBits bitsOf(const Pose& pose) {
    const Quatd& q = pose.rotation;
    return {bitsOf(pose.translation), bitsOf(q.w()), bitsOf(q.x()), bitsOf(q.y()), bitsOf(q.z()), bitsOf(pose.scale)};
}

/// Reads the values of records; keeps the first thing that is wrong.
class Reader {
public:
    [[nodiscard]] const char* fault() const { return fault_; }

    double number(Bits bits) {
        const double value = std::bit_cast<double>(bits);
        check(std::isfinite(value), "a number that is not finite");
        return value;
    }
    Vec3d vector(const Bits3& bits) { return {number(bits.x), number(bits.y), number(bits.z)}; }
    double time(Bits bits) {
        const double value = number(bits);
        check(value >= 0 && value <= 1, "a time outside the frame");
        return value;
    }
    double depth(Bits bits) {
        const double value = number(bits);
        check(value >= 0 || value == ContactValue::kNoDepth, "a depth below zero");
        return value;
    }
    Vec2d place(const Bits2& bits) {
        const Vec2d uv(number(bits.x), number(bits.y));
        check(uv.x() >= 0 && uv.y() >= 0 && uv.x() <= 1 && uv.y() <= 1, "a place beside its face");
        return uv;
    }
    Vec2d parameters(const Bits2& bits) { return {number(bits.x), number(bits.y)}; }
    double distance(Bits bits) {
        const double value = number(bits);
        check(value >= 0, "a distance below zero");
        return value;
    }
    Pose pose(const PoseBits& bits) {
        Pose pose;
        pose.translation = vector(bits.translation);
        pose.rotation = Quatd(number(bits.w), number(bits.x), number(bits.y), number(bits.z));
        check(tellsRotation(pose.rotation.squaredNorm()), "a quaternion that cannot be normalised");
        pose.scale = vector(bits.scale);
        return pose;
    }
    TouchPhase phase(std::uint32_t value) {
        check(value <= static_cast<std::uint32_t>(TouchPhase::kEnded), "a phase that does not exist");
        return fault_ ? TouchPhase::kBegan : static_cast<TouchPhase>(value);
    }
    bool flag(std::uint32_t value) {
        check(value <= 1, "a flag that is neither 0 nor 1");
        return value == 1;
    }
    void zero(std::uint32_t value) { check(value == 0, "bytes in use that this version does not know"); }

private:
    void check(bool right, const char* otherwise) {
        if (!right && !fault_) fault_ = otherwise;
    }
    const char* fault_ = nullptr;
};

ContactRecord recordOf(const ContactValue& c) {
    return {.objectA = c.objectA.value,
            .objectB = c.objectB.value,
            .faceA = c.faceA,
            .faceB = c.faceB,
            .point = bitsOf(c.point),
            .normal = bitsOf(c.normal),
            .depth = bitsOf(c.depth),
            .error = bitsOf(c.error),
            .uvA = bitsOf(c.uvA),
            .uvB = bitsOf(c.uvB),
            .interest = c.interest.value,
            .time = bitsOf(c.time),
            .patchA = c.patchA,
            .patchB = c.patchB,
            .patchUvA = bitsOf(c.patchUvA),
            .patchUvB = bitsOf(c.patchUvB)};
}
ContactValue valueOf(const ContactRecord& r, Reader& in) {
    return {.objectA = ObjectId{r.objectA},
            .objectB = ObjectId{r.objectB},
            .faceA = r.faceA,
            .faceB = r.faceB,
            .point = in.vector(r.point),
            .normal = in.vector(r.normal),
            .depth = in.depth(r.depth),
            .uvA = in.place(r.uvA),
            .uvB = in.place(r.uvB),
            .patchA = r.patchA,
            .patchB = r.patchB,
            .patchUvA = in.parameters(r.patchUvA),
            .patchUvB = in.parameters(r.patchUvB),
            .error = in.distance(r.error),
            .interest = ObjectId{r.interest},
            .time = in.time(r.time)};
}

PairEventRecord recordOf(const PairEventValue& e) {
    return {.interest = e.interest.value,
            .objectA = e.objectA.value,
            .objectB = e.objectB.value,
            .phase = static_cast<std::uint32_t>(e.phase),
            .through = e.through,
            .firstTime = bitsOf(e.firstTime),
            .point = bitsOf(e.point),
            .normal = bitsOf(e.normal)};
}
PairEventValue valueOf(const PairEventRecord& r, Reader& in) {
    return {.interest = ObjectId{r.interest},
            .objectA = ObjectId{r.objectA},
            .objectB = ObjectId{r.objectB},
            .phase = in.phase(r.phase),
            .firstTime = in.time(r.firstTime),
            .point = in.vector(r.point),
            .normal = in.vector(r.normal),
            .through = in.flag(r.through)};
}

PairDistanceRecord recordOf(const PairDistanceValue& d) {
    return {.interest = d.interest.value,
            .objectA = d.objectA.value,
            .objectB = d.objectB.value,
            .nodeA = d.nodeA.value,
            .nodeB = d.nodeB.value,
            .faceA = d.faceA,
            .faceB = d.faceB,
            .phase = static_cast<std::uint32_t>(d.phase),
            .reserved = 0,
            .distance = bitsOf(d.distance),
            .error = bitsOf(d.error),
            .pointA = bitsOf(d.pointA),
            .pointB = bitsOf(d.pointB)};
}
PairDistanceValue valueOf(const PairDistanceRecord& r, Reader& in) {
    in.zero(r.reserved);
    return {.interest = ObjectId{r.interest},
            .objectA = ObjectId{r.objectA},
            .objectB = ObjectId{r.objectB},
            .phase = in.phase(r.phase),
            .distance = in.distance(r.distance),
            .nodeA = ObjectId{r.nodeA},
            .nodeB = ObjectId{r.nodeB},
            .faceA = r.faceA,
            .faceB = r.faceB,
            .pointA = in.vector(r.pointA),
            .pointB = in.vector(r.pointB),
            .error = in.distance(r.error)};
}

QuestionRecord recordOf(const QuestionValue& q) {
    return {.id = q.id,
            .interest = q.interest.value,
            .objectA = q.objectA.value,
            .objectB = q.objectB.value,
            .transform = q.transform.value,
            .present = bitsOf(q.present),
            .wanted = bitsOf(q.wanted),
            .point = bitsOf(q.point),
            .normal = bitsOf(q.normal)};
}
QuestionValue valueOf(const QuestionRecord& r, Reader& in) {
    return {.id = r.id,
            .interest = ObjectId{r.interest},
            .objectA = ObjectId{r.objectA},
            .objectB = ObjectId{r.objectB},
            .transform = ObjectId{r.transform},
            .present = in.pose(r.present),
            .wanted = in.pose(r.wanted),
            .point = in.vector(r.point),
            .normal = in.vector(r.normal)};
}

template <typename Record, typename Value>
Bytes pack(std::span<const Value> values) {
    std::vector<Record> records;
    records.reserve(values.size());
    for (const Value& value : values) records.push_back(recordOf(value));
    const ByteSpan bytes = recordBytes(records);
    return Bytes(bytes.begin(), bytes.end());
}

template <typename Record, typename Value>
Expected<std::vector<Value>> unpack(ByteSpan bytes, std::size_t most) {
    const Expected<std::vector<Record>> records = recordsFrom<Record>(bytes, most);
    if (!records) return tl::unexpected(records.error());
    std::vector<Value> values;
    values.reserve(records->size());
    Reader in;
    for (const Record& record : *records) {
        values.push_back(valueOf(record, in));
        if (in.fault()) return fail(ErrorCode::kBadInput, in.fault());
    }
    return values;
}

}  // namespace

Bytes packContacts(std::span<const ContactValue> contacts) {
    return pack<ContactRecord>(contacts);
}
Bytes packEvents(std::span<const PairEventValue> events) {
    return pack<PairEventRecord>(events);
}
Bytes packDistances(std::span<const PairDistanceValue> distances) {
    return pack<PairDistanceRecord>(distances);
}
Bytes packQuestions(std::span<const QuestionValue> questions) {
    return pack<QuestionRecord>(questions);
}

Expected<std::vector<ContactValue>> unpackContacts(ByteSpan bytes, std::size_t most) {
    return unpack<ContactRecord, ContactValue>(bytes, most);
}
Expected<std::vector<PairEventValue>> unpackEvents(ByteSpan bytes, std::size_t most) {
    return unpack<PairEventRecord, PairEventValue>(bytes, most);
}
Expected<std::vector<PairDistanceValue>> unpackDistances(ByteSpan bytes, std::size_t most) {
    return unpack<PairDistanceRecord, PairDistanceValue>(bytes, most);
}
Expected<std::vector<QuestionValue>> unpackQuestions(ByteSpan bytes, std::size_t most) {
    return unpack<QuestionRecord, QuestionValue>(bytes, most);
}

}  // namespace tessera
