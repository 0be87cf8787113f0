#include "common/codec/MemberCodec.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <initializer_list>
#include <limits>

#include "common/codec/RecordCodec.h"
#include "common/request/Check.h"

namespace tessera {
namespace {

using Kind = HeadField::Kind;

Kind kindOnWire(const ValueType& type) {
    switch (type.kind) {
        case ValueKind::kNumber:
            return Kind::kFixed;
        case ValueKind::kBool:
        case ValueKind::kUnsigned:
        case ValueKind::kWord:
            return Kind::kVarint;
        default:
            return Kind::kBytes;
    }
}

/// A number as the 64 bits that travel.
std::uint64_t bitsOf(const ValueType& type, const void* value) {
    if (type.kind == ValueKind::kNumber) return std::bit_cast<std::uint64_t>(*static_cast<const double*>(value));
    return integerOf(type, value);
}

std::size_t most(std::size_t ApplicationLimits::*of, const ApplicationLimits& limits) {
    return of != nullptr ? limits.*of : std::numeric_limits<std::size_t>::max();
}

}  // namespace

// ---- writing

Bytes MemberWriter::joined(int number, const Description& of, const void* value) {
    const HeadWriter::Opened opened = head_.open(number);
    write(of, value);
    head_.close(opened);
    return joinParts(head_.bytes(), parts_);
}

void MemberWriter::write(const Description& of, const void* value, int before) {
    for (const MemberEntry& m : of.members)
        if (of.calledFor(m, value)) put(m, m.in(value), before + m.number);
}

void MemberWriter::put(const MemberEntry& m, const void* member, int number) {
    switch (m.form) {
        case MemberForm::kSpread:
            return write(*m.held.described, member, number - 1);
        case MemberForm::kFixed:
            return head_.fixed(number, bitsOf(m.held, member));
        case MemberForm::kNumbers:
            if (m.count(member) == 0) return;
            if (m.manner == Manner::kOptional) head_.varint(number++, 1);
            return numbers(number, m.at(member, 0));
        case MemberForm::kPart:
            return part(m, member);
        case MemberForm::kRest: {
            const auto& rest = *static_cast<const std::vector<ByteSlice>*>(member);
            parts_.insert(parts_.end(), rest.begin(), rest.end());
            return;
        }
        case MemberForm::kHead:
            return putField(m, member, number);
        case MemberForm::kReserved:
            return;
    }
}

void MemberWriter::putField(const MemberEntry& m, const void* member, int number) {
    if (m.manner == Manner::kMany) return many(m, member, number);
    if (m.manner == Manner::kOptional) {
        if (m.count(member) > 0) always(m.held, number, m.at(member, 0));
        return;
    }
    switch (m.held.kind) {
        case ValueKind::kNumber:
            return head_.fixed(number, bitsOf(m.held, member));
        case ValueKind::kText:
            return head_.text(number, *static_cast<const std::string*>(member));
        case ValueKind::kBool:
        case ValueKind::kUnsigned:
        case ValueKind::kWord:
            return head_.varint(number, bitsOf(m.held, member));
        default:
            return always(m.held, number, member);
    }
}

void MemberWriter::numbers(int number, const void* place) {
    const auto* const values = static_cast<const double*>(place);
    head_.fixed(number, std::bit_cast<std::uint64_t>(values[0]));
    head_.fixed(number + 1, std::bit_cast<std::uint64_t>(values[1]));
}

void MemberWriter::always(const ValueType& type, int number, const void* value) {
    const auto* const numbers = static_cast<const double*>(value);
    const auto coordinates = [&](std::initializer_list<double> all) {
        int next = 0;
        for (const double each : all) head_.fixed(++next, std::bit_cast<std::uint64_t>(each));
    };
    switch (type.kind) {
        case ValueKind::kNumber:
            return head_.fixedAlways(number, bitsOf(type, value));
        case ValueKind::kText:
            return head_.textAlways(number, *static_cast<const std::string*>(value));
        case ValueKind::kVector:
        case ValueKind::kRotation:
        case ValueKind::kValue: {
            const HeadWriter::Opened opened = head_.open(number);
            if (type.kind == ValueKind::kVector)
                coordinates({numbers[0], numbers[1], numbers[2]});
            else if (type.kind == ValueKind::kRotation)  // w is said first, and Eigen keeps it last
                coordinates({numbers[3], numbers[0], numbers[1], numbers[2]});
            else
                write(*type.described, value);
            return head_.close(opened);
        }
        default:
            return head_.varintAlways(number, bitsOf(type, value));
    }
}

void MemberWriter::many(const MemberEntry& m, const void* values, int number) {
    const std::size_t count = m.count(values);
    if (m.held.kind == ValueKind::kText || m.held.kind == ValueKind::kValue) {
        for (std::size_t i = 0; i < count; ++i) always(m.held, number, m.at(values, i));
        return;
    }
    if (count == 0) return;
    const HeadWriter::Opened opened = head_.open(number);
    for (std::size_t i = 0; i < count; ++i) {
        if (m.held.kind == ValueKind::kNumber)
            head_.fixedElement(bitsOf(m.held, m.at(values, i)));
        else
            head_.varintElement(bitsOf(m.held, m.at(values, i)));
    }
    head_.close(opened);
}

void MemberWriter::part(const MemberEntry& m, const void* member) {
    if (m.held.kind == ValueKind::kBytes) return parts_.push_back(*static_cast<const ByteSlice*>(member));
    const std::size_t count = m.count(member);
    const void* const first = count > 0 ? m.at(member, 0) : nullptr;
    if (m.held.kind != ValueKind::kValue)
        return parts_.push_back({static_cast<const std::byte*>(first), count * m.held.bytes});
    PackedRecords packed = packRecords(*m.held.described, first, count);
    parts_.push_back(made_.emplace_back(std::move(packed.bytes)));
    if (m.held.described->recordHasTexts) parts_.push_back(made_.emplace_back(std::move(packed.texts)));
}

// ---- reading

void MemberReader::clear(const Description& of, void* value) {
    for (const MemberEntry& m : of.members) {
        if (!m.isOfHead()) continue;
        if (m.manner == Manner::kOne)
            toZero(m.held, m.in(value));
        else
            m.holder.resize(m.in(value), 0);
    }
}

void MemberReader::toZero(const ValueType& type, void* value) {
    switch (type.kind) {
        case ValueKind::kValue:
            return clear(*type.described, value);
        case ValueKind::kText:
            return static_cast<std::string*>(value)->clear();
        case ValueKind::kBytes:
            *static_cast<ByteSlice*>(value) = {};
            return;
        default:
            std::memset(value, 0, type.bytes);
            return;  // numbers
    }
}

void MemberReader::take(const Description& of, void* value, ByteSpan head) {
    eachField(head, [&](const HeadField& field) { takeField(of, value, field, 0); });
}

void MemberReader::takeField(const Description& of, void* value, const HeadField& field, int before) {
    for (const MemberEntry& m : of.members)
        if (m.isOfHead()) takeMember(m, m.in(value), field, before + m.number);
}

void MemberReader::takeMember(const MemberEntry& m, void* member, const HeadField& field, int number) {
    if (m.form == MemberForm::kSpread) return takeField(*m.held.described, member, field, number - 1);
    if (m.form == MemberForm::kNumbers) return takePlace(m, member, field, number);
    if (field.number != number) return;
    if (m.form == MemberForm::kFixed) {
        if (field.kind == Kind::kFixed) setInteger(m.held, member, field.value);
        return;
    }
    if (m.manner == Manner::kMany) return takeMany(m, member, field);
    if (field.kind != kindOnWire(m.held)) return;
    if (m.manner == Manner::kOptional && m.count(member) == 0) toZero(m.held, m.add(member));
    takeOne(m, m.at(member, 0), field);
}

void MemberReader::takePlace(const MemberEntry& m, void* member, const HeadField& field, int number) {
    if (m.manner == Manner::kOptional) {
        // Numbers ascend in what we are sent by our own; of whom else they come before the flag they are not looked at.
        if (field.number == number && field.kind == Kind::kVarint) {
            if (field.value == 0)
                m.holder.resize(member, 0);
            else if (m.count(member) == 0)
                toZero(m.held, m.add(member));
        }
        if (m.count(member) == 0) return;
        ++number;
    }
    if (field.kind != Kind::kFixed || field.number < number || field.number > number + 1) return;
    static_cast<double*>(m.at(member, 0))[field.number - number] = std::bit_cast<double>(field.value);
}

void MemberReader::takeMany(const MemberEntry& m, void* values, const HeadField& field) {
    const std::size_t allowed = most(m.most, limits_);
    const auto room = [&] {
        if (m.count(values) < allowed) return true;
        refuse(ErrorCode::kLimit, fmt::format("{} has more than the {} entries that are allowed", m.name, allowed));
        return false;
    };
    const Kind kind = kindOnWire(m.held);
    const auto takeNumber = [&](std::uint64_t number) {
        if (!room()) return false;
        takeOne(m, m.add(values), {.kind = kind, .value = number, .bytes = {}});
        return true;
    };
    if (kind == Kind::kBytes) {
        if (field.kind != kind || !room()) return;
        void* const value = m.add(values);
        toZero(m.held, value);
        takeOne(m, value, field);
    } else if (field.kind == kind) {
        takeNumber(field.value);
    } else if (field.kind == Kind::kBytes) {
        const bool whole =
            kind == Kind::kVarint ? eachVarint(field.bytes, takeNumber) : eachFixed(field.bytes, takeNumber);
        if (!whole) refuse(ErrorCode::kBadInput, fmt::format("{} ends in the middle of a number", m.name));
    }
}

void MemberReader::takeOne(const MemberEntry& m, void* value, const HeadField& field) {
    switch (m.held.kind) {
        case ValueKind::kNumber:
            *static_cast<double*>(value) = std::bit_cast<double>(field.value);
            return;
        case ValueKind::kText:
            if (field.bytes.size() > limits_.maxTextBytes)
                return refuse(ErrorCode::kLimit, fmt::format("{} has {} bytes; at most {} are allowed", m.name,
                                                             field.bytes.size(), limits_.maxTextBytes));
            *static_cast<std::string*>(value) = asText(field.bytes);
            return;
        case ValueKind::kVector:
            return takeCoordinates(static_cast<double*>(value), 3, 0, field.bytes);
        // Eigen keeps w behind the others.
        case ValueKind::kRotation:
            return takeCoordinates(static_cast<double*>(value), 4, 3, field.bytes);
        case ValueKind::kValue:
            return take(*m.held.described, value, field.bytes);
        default:
            if (!setInteger(m.held, value, field.value))
                refuse(m.held.kind == ValueKind::kWord ? ErrorCode::kUnsupported : ErrorCode::kBadInput,
                       fmt::format("{} says {}, which this version does not know", m.name, field.value));
    }
}

/// The first of them that is said is in place `first`.
void MemberReader::takeCoordinates(double* value, std::size_t count, std::size_t first, ByteSpan bytes) {
    eachField(bytes, [&](const HeadField& field) {
        const std::size_t i = static_cast<std::size_t>(field.number) - 1;
        if (field.kind == Kind::kFixed && i < count) value[(i + first) % count] = std::bit_cast<double>(field.value);
    });
}

void MemberReader::finish(const Description& of, void* value) {
    takeParts(of, value);
    if (nextPart_ != partCount())
        refuse(ErrorCode::kBadInput, fmt::format("it has {} parts instead of {}", partCount(), nextPart_));
    if (error()) return;
    if (std::optional<Error> fault = findFault(of, value, limits_)) refuse(fault->code, std::move(fault->message));
}

void MemberReader::takeParts(const Description& of, void* value) {
    for (const MemberEntry& m : of.members) {
        void* const member = m.in(value);
        // A member that is not to be said is as it is in a fresh one.
        if (!of.calledFor(m, value)) {
            m.assign(member, m.in(of.fresh));
        } else if (m.form == MemberForm::kPart) {
            takePart(m, member);
        } else if (m.form == MemberForm::kRest) {
            takeRest(m, *static_cast<std::vector<ByteSlice>*>(member));
        } else if (m.held.kind == ValueKind::kValue) {
            for (std::size_t i = 0; i < m.count(member); ++i) takeParts(*m.held.described, m.at(member, i));
        }
    }
}

/// None where there is none; too many bytes are as good as none.
ByteSpan MemberReader::nextPart(const MemberEntry& m) {
    const std::size_t index = nextPart_++;
    if (index >= partCount()) return {};
    if (m.mostBytes == nullptr || within(part(index).size(), limits_.*m.mostBytes, "bytes of " + std::string(m.name)))
        return part(index);
    return {};
}

void MemberReader::takePart(const MemberEntry& m, void* member) {
    if (m.held.kind == ValueKind::kBytes) {
        const std::size_t index = nextPart_;
        if (!nextPart(m).empty()) *static_cast<ByteSlice*>(member) = bytes(index);
        return;
    }
    const std::size_t allowed = m.manner == Manner::kOptional ? 1 : most(m.most, limits_);
    const ByteSpan records = nextPart(m);
    Expected<void> taken;
    if (m.held.kind != ValueKind::kValue) {
        taken = unpackNumbers(m.held.bytes, records, allowed, m.holder, member);
    } else {
        const ByteSpan texts = m.held.described->recordHasTexts ? nextPart(m) : ByteSpan();
        taken = unpackRecords(*m.held.described, records, allowed, texts, m.holder, member);
    }
    if (!taken) refuse(taken.error().code, taken.error().message);
}

void MemberReader::takeRest(const MemberEntry& m, std::vector<ByteSlice>& values) {
    const std::size_t left = partCount() - std::min(nextPart_, partCount());
    if (!within(left, limits_.*m.most, m.name)) return;
    values.reserve(left);
    for (; nextPart_ < partCount(); ++nextPart_) values.push_back(bytes(nextPart_));
}

}  // namespace tessera
