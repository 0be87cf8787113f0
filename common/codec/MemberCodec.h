/// Whatever is described (common/request/Description.h) as bytes and back: small members in a protobuf head
/// (MessageHead.h), bulk as parts behind it (Parts.h). Not for other modules.
#pragma once

#include <deque>
#include <vector>

#include "common/codec/MessageHead.h"
#include "common/codec/Unpacker.h"
#include "common/request/Description.h"

namespace tessera {

/// One message: its members' fields of a head, in the order of their numbers, and its parts. What is written must live
/// as long as this.
class MemberWriter {
public:
    /// All of it, as the message of this number within the head.
    [[nodiscard]] Bytes joined(int number, const Description& of, const void* value);

private:
    void write(const Description& of, const void* value, int before = 0);
    void put(const MemberEntry& m, const void* member, int number);
    void putField(const MemberEntry& m, const void* member, int number);
    void numbers(int number, const void* place);
    /// Where nothing is something, too.
    void always(const ValueType& type, int number, const void* value);
    void many(const MemberEntry& m, const void* values, int number);
    void part(const MemberEntry& m, const void* member);

    HeadWriter head_;
    std::vector<ByteSpan> parts_;
    std::deque<Bytes> made_;  ///< parts that do not lie in the message as they travel
};

/// One message: what it says is put into its members, as protobuf would: in any order, the last of a number counts,
/// messages within this one are merged, and what has an unknown number or another kind than asked for is as if it were
/// not there.
class MemberReader : public Unpacker {
public:
    MemberReader(ByteSlice whole, std::vector<ByteSpan> parts, const ApplicationLimits& limits)
        : Unpacker(std::move(whole), std::move(parts), limits.maxTextBytes), limits_(limits) {}

    /// As if nothing had been said: zeros, whatever a fresh one holds.
    void clear(const Description& of, void* value);
    /// Of a message within the head.
    void take(const Description& of, void* value, ByteSpan head);
    /// What is no field; and whether all of it is as it may be.
    void finish(const Description& of, void* value);
    template <typename Take>
    void eachField(ByteSpan head, Take&& take) {
        HeadFields fields(head);
        while (!error()) {
            const Expected<std::optional<HeadField>> field = fields.next();
            if (!field) return refuse(field.error().code, field.error().message);
            if (!*field) return;
            take(**field);
        }
    }

private:
    void toZero(const ValueType& type, void* value);
    void takeField(const Description& of, void* value, const HeadField& field, int before);
    void takeMember(const MemberEntry& m, void* member, const HeadField& field, int number);
    void takePlace(const MemberEntry& m, void* member, const HeadField& field, int number);
    void takeMany(const MemberEntry& m, void* values, const HeadField& field);
    /// Of the right kind.
    void takeOne(const MemberEntry& m, void* value, const HeadField& field);
    void takeCoordinates(double* value, std::size_t count, std::size_t first, ByteSpan bytes);
    // Parts, in the order of the members.
    void takeParts(const Description& of, void* value);
    void takePart(const MemberEntry& m, void* member);
    void takeRest(const MemberEntry& m, std::vector<ByteSlice>& values);
    [[nodiscard]] ByteSpan nextPart(const MemberEntry& m);

    const ApplicationLimits& limits_;
    std::size_t nextPart_ = 0;
};

}  // namespace tessera
