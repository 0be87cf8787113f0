/// Whatever is described (common/request/Members.h) as bytes and back: small members in a protobuf head
/// (MessageHead.h), bulk as parts behind it (Parts.h). Not for other modules.
#pragma once

#include <bit>
#include <deque>
#include <limits>
#include <span>

#include "common/codec/MessageHead.h"
#include "common/codec/RecordCodec.h"
#include "common/codec/Unpacker.h"
#include "common/request/Check.h"

namespace tessera {

// ---- writing

/// One message: its members' fields of a head, in the order of their numbers, and its parts. What is written must live
/// as long as this.
class MemberWriter {
public:
    template <HasMembers T>
    void write(const T& value, int before = 0) {
        forEachMember<T>([&]<typename M>(const M& m) {
            static_assert(M::kForm != MemberForm::kReserved, "of records alone");
            if (m.when == nullptr || m.when(value)) put(m, M::of(value), before + m.number);
        });
    }
    /// All of it, as the message of this number within the head.
    template <HasMembers T>
    [[nodiscard]] Bytes joined(int number, const T& value) {
        const HeadWriter::Opened opened = head_.open(number);
        write(value);
        head_.close(opened);
        return joinParts(head_.bytes(), parts_);
    }

private:
    template <typename M, typename T>
    void put(const M&, const T& value, int number) {
        if constexpr (M::kForm == MemberForm::kSpread) {
            write(value, number - 1);
        } else if constexpr (M::kForm == MemberForm::kFixed) {
            head_.fixed(number, wireNumber(value));
        } else if constexpr (M::kForm == MemberForm::kNumbers) {
            if constexpr (kIsOptional<T>) {
                if (!value) return;
                head_.varint(number, 1);
                numbers(number + 1, *value);
            } else {
                numbers(number, value);
            }
        } else if constexpr (M::kForm == MemberForm::kPart) {
            part(value);
        } else if constexpr (M::kForm == MemberForm::kRest) {
            parts_.insert(parts_.end(), value.begin(), value.end());
        } else if constexpr (kIsOptional<T>) {
            if (value) always(number, *value);
        } else if constexpr (kIsMany<T>) {
            many(number, value);
        } else {
            constexpr ValueKind kind = valueKindOf<T>();
            if constexpr (kind == ValueKind::kNumber)
                head_.fixed(number, std::bit_cast<std::uint64_t>(value));
            else if constexpr (kind == ValueKind::kText)
                head_.text(number, value);
            else if constexpr (kind == ValueKind::kBool || kind == ValueKind::kUnsigned || kind == ValueKind::kWord)
                head_.varint(number, wireNumber(value));
            else
                always(number, value);
        }
    }
    void numbers(int number, const Vec2d& value) {
        head_.fixed(number, std::bit_cast<std::uint64_t>(value.x()));
        head_.fixed(number + 1, std::bit_cast<std::uint64_t>(value.y()));
    }
    /// Where nothing is something, too.
    template <typename T>
    void always(int number, const T& value) {
        constexpr ValueKind kind = valueKindOf<T>();
        if constexpr (kind == ValueKind::kNumber) {
            head_.fixedAlways(number, std::bit_cast<std::uint64_t>(value));
        } else if constexpr (kind == ValueKind::kText) {
            head_.textAlways(number, value);
        } else if constexpr (kind == ValueKind::kVector || kind == ValueKind::kRotation || kind == ValueKind::kValue) {
            const HeadWriter::Opened opened = head_.open(number);
            if constexpr (kind == ValueKind::kVector)
                coordinates({value.x(), value.y(), value.z()});
            else if constexpr (kind == ValueKind::kRotation)
                coordinates({value.w(), value.x(), value.y(), value.z()});
            else
                write(value);
            head_.close(opened);
        } else {
            head_.varintAlways(number, wireNumber(value));
        }
    }
    void coordinates(std::initializer_list<double> values) {
        int number = 0;
        for (const double value : values) head_.fixed(++number, std::bit_cast<std::uint64_t>(value));
    }
    template <typename T>
    void many(int number, const std::vector<T>& values) {
        constexpr ValueKind kind = valueKindOf<T>();
        if constexpr (kind == ValueKind::kText || kind == ValueKind::kValue) {
            for (const T& value : values) always(number, value);
        } else {
            if (values.empty()) return;
            const HeadWriter::Opened opened = head_.open(number);
            for (const T value : values) {
                if constexpr (kind == ValueKind::kNumber)
                    head_.fixedElement(std::bit_cast<std::uint64_t>(value));
                else
                    head_.varintElement(wireNumber(value));
            }
            head_.close(opened);
        }
    }

    void part(const ByteSlice& bytes) { parts_.push_back(bytes); }
    template <HasMembers R>
    void part(const std::optional<R>& record) {
        part(std::span<const R>(record ? &*record : nullptr, record ? 1 : 0));
    }
    template <typename R>
    void part(const std::vector<R>& records) {
        if constexpr (HasMembers<R>)
            part(std::span<const R>(records));
        else
            parts_.push_back(recordBytes(records));
    }
    template <HasMembers R>
    void part(std::span<const R> records) {
        RecordWriter writer(records);
        parts_.push_back(made_.emplace_back(std::move(writer.bytes())));
        if constexpr (recordHasTexts<R>()) parts_.push_back(made_.emplace_back(std::move(writer.texts())));
    }

    HeadWriter head_;
    std::vector<ByteSpan> parts_;
    std::deque<Bytes> made_;  ///< parts that do not lie in the message as they travel
};

// ---- reading

/// One message: what it says is put into its members, as protobuf would: in any order, the last of a number counts,
/// messages within this one are merged, and what has an unknown number or another kind than asked for is as if it were
/// not there.
class MemberReader : public Unpacker {
public:
    MemberReader(ByteSlice whole, std::vector<ByteSpan> parts, const ApplicationLimits& limits)
        : Unpacker(std::move(whole), std::move(parts), limits.maxTextBytes), limits_(limits) {}

    /// As if nothing had been said: zeros, whatever a fresh T holds.
    template <HasMembers T>
    void clear(T& value) {
        forEachMember<T>([&]<typename M>(const M&) {
            if constexpr (M::kForm != MemberForm::kPart && M::kForm != MemberForm::kRest) toZero(M::of(value));
        });
    }
    /// Of a message within the head.
    template <HasMembers T>
    void take(T& value, ByteSpan head) {
        eachField(head, [&](const HeadField& field) { takeField(value, field, 0); });
    }
    /// What is no field; and whether all of it is as it may be.
    template <HasMembers T>
    void finish(T& value) {
        takeParts(value);
        if (nextPart_ != partCount())
            refuse(ErrorCode::kBadInput, fmt::format("it has {} parts instead of {}", partCount(), nextPart_));
        if (error()) return;
        if (std::optional<Error> fault = findFault(value, limits_)) refuse(fault->code, std::move(fault->message));
    }
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
    template <typename T>
    void toZero(T& value) {
        if constexpr (kIsOptional<T>) {
            value.reset();
        } else if constexpr (kIsMany<T>) {
            value.clear();
        } else {
            constexpr ValueKind kind = valueKindOf<T>();
            if constexpr (kind == ValueKind::kPlace || kind == ValueKind::kVector)
                value.setZero();
            else if constexpr (kind == ValueKind::kRotation)
                value.coeffs().setZero();
            else if constexpr (kind == ValueKind::kValue)
                clear(value);
            else
                value = T{};
        }
    }

    template <HasMembers T>
    void takeField(T& value, const HeadField& field, int before) {
        forEachMember<T>([&]<typename M>(const M& m) {
            if constexpr (M::kForm == MemberForm::kPart || M::kForm == MemberForm::kRest)
                return;
            else
                takeMember(m, M::of(value), field, before + m.number);
        });
    }
    template <typename M, typename T>
    void takeMember(const M& m, T& value, const HeadField& field, int number) {
        using Kind = HeadField::Kind;
        if constexpr (M::kForm == MemberForm::kSpread) {
            takeField(value, field, number - 1);
        } else if constexpr (M::kForm == MemberForm::kNumbers) {
            if constexpr (kIsOptional<T>) {
                // Numbers ascend in what we are sent by our own; of whom else they come before the flag they are not
                // looked at.
                if (field.number == number && field.kind == Kind::kVarint) {
                    if (field.value == 0)
                        value.reset();
                    else if (!value)
                        value = Vec2d(0, 0);
                }
                if (value) takeNumbers(*value, field, number + 1);
            } else {
                takeNumbers(value, field, number);
            }
        } else if (field.number != number) {
            return;
        } else if constexpr (M::kForm == MemberForm::kFixed) {
            if (field.kind == Kind::kFixed) value = T(field.value);
        } else if constexpr (kIsMany<T>) {
            takeMany(m, value, field);
        } else {
            if (field.kind != kindOnWire<HeldType<M>>()) return;
            if constexpr (kIsOptional<T>) {
                if (!value) toZero(value.emplace());
                takeOne(m, *value, field);
            } else {
                takeOne(m, value, field);
            }
        }
    }
    void takeNumbers(Vec2d& value, const HeadField& field, int number) {
        if (field.kind != HeadField::Kind::kFixed) return;
        if (field.number == number) value.x() = std::bit_cast<double>(field.value);
        if (field.number == number + 1) value.y() = std::bit_cast<double>(field.value);
    }
    template <typename M, typename T>
    void takeMany(const M& m, std::vector<T>& values, const HeadField& field) {
        using Kind = HeadField::Kind;
        const std::size_t most = m.most != nullptr ? limits_.*m.most : std::numeric_limits<std::size_t>::max();
        const auto room = [&] {
            if (values.size() < most) return true;
            refuse(ErrorCode::kLimit, fmt::format("{} has more than the {} entries that are allowed", m.name, most));
            return false;
        };
        constexpr Kind kKind = kindOnWire<T>();
        const auto takeNumber = [&](std::uint64_t number) {
            if (!room()) return false;
            takeOne(m, values.emplace_back(), {.kind = kKind, .value = number, .bytes = {}});
            return true;
        };
        if constexpr (kKind == Kind::kBytes) {
            if (field.kind != kKind || !room()) return;
            toZero(values.emplace_back());
            takeOne(m, values.back(), field);
        } else if (field.kind == kKind) {
            takeNumber(field.value);
        } else if (field.kind == Kind::kBytes) {
            const bool whole =
                kKind == Kind::kVarint ? eachVarint(field.bytes, takeNumber) : eachFixed(field.bytes, takeNumber);
            if (!whole) refuse(ErrorCode::kBadInput, fmt::format("{} ends in the middle of a number", m.name));
        }
    }
    template <typename T>
    static constexpr HeadField::Kind kindOnWire() {
        constexpr ValueKind kind = valueKindOf<T>();
        if (kind == ValueKind::kNumber) return HeadField::Kind::kFixed;
        const bool isInteger = kind == ValueKind::kBool || kind == ValueKind::kUnsigned || kind == ValueKind::kWord;
        return isInteger ? HeadField::Kind::kVarint : HeadField::Kind::kBytes;
    }
    /// Of the right kind.
    template <typename M, typename T>
    void takeOne(const M& m, T& value, const HeadField& field) {
        constexpr ValueKind kind = valueKindOf<T>();
        if constexpr (kind == ValueKind::kNumber) {
            value = std::bit_cast<double>(field.value);
        } else if constexpr (kind == ValueKind::kText) {
            if (field.bytes.size() > limits_.maxTextBytes)
                refuse(ErrorCode::kLimit, fmt::format("{} has {} bytes; at most {} are allowed", m.name,
                                                      field.bytes.size(), limits_.maxTextBytes));
            else
                value = asText(field.bytes);
        } else if constexpr (kind == ValueKind::kVector) {
            takeCoordinates(
                field.bytes, [&](int i) -> double& { return value[i]; }, 3);
        } else if constexpr (kind == ValueKind::kRotation) {
            // Eigen keeps w behind the others.
            takeCoordinates(
                field.bytes, [&](int i) -> double& { return value.coeffs()[(i + 3) % 4]; }, 4);
        } else if constexpr (kind == ValueKind::kValue) {
            take(value, field.bytes);
        } else {
            const std::optional<T> known = wireValue<T>(field.value);
            if (!known)
                refuse(kind == ValueKind::kWord ? ErrorCode::kUnsupported : ErrorCode::kBadInput,
                       fmt::format("{} says {}, which this version does not know", m.name, field.value));
            value = known.value_or(T{});
        }
    }
    template <typename Coordinate>
    void takeCoordinates(ByteSpan bytes, Coordinate coordinate, int count) {
        eachField(bytes, [&](const HeadField& field) {
            if (field.kind == HeadField::Kind::kFixed && field.number <= count)
                coordinate(field.number - 1) = std::bit_cast<double>(field.value);
        });
    }

    // ---- parts, in the order of the members

    template <HasMembers T>
    void takeParts(T& value) {
        forEachMember<T>([&]<typename M>(const M& m) {
            // What is not to be said is as it is in a fresh one.
            if (m.when != nullptr && !m.when(value)) return void(M::of(value) = M::of(T{}));
            if constexpr (M::kForm == MemberForm::kPart) {
                takePart(m, M::of(value));
            } else if constexpr (M::kForm == MemberForm::kRest) {
                takeRest(m, M::of(value));
            } else if constexpr (HasMembers<HeldType<M>>) {
                if constexpr (kIsMany<typename M::Type>)
                    for (auto& each : M::of(value)) takeParts(each);
                else if constexpr (kIsOptional<typename M::Type>) {
                    if (M::of(value)) takeParts(*M::of(value));
                } else {
                    takeParts(M::of(value));
                }
            }
        });
    }
    /// None where there is none; too many bytes are as good as none.
    template <typename M>
    [[nodiscard]] ByteSpan nextPart(const M& m) {
        const std::size_t index = nextPart_++;
        if (index >= partCount()) return {};
        if (m.mostBytes == nullptr ||
            within(part(index).size(), limits_.*m.mostBytes, "bytes of " + std::string(m.name)))
            return part(index);
        return {};
    }
    template <typename M>
    void takePart(const M& m, ByteSlice& value) {
        const std::size_t index = nextPart_;
        if (!nextPart(m).empty()) value = bytes(index);
    }
    template <typename M, typename R>
    void takePart(const M& m, std::optional<R>& value) {
        std::vector<R> records = taken(unpackRecords<R>(nextPart(m), 1));
        if (!records.empty()) value = std::move(records.front());
    }
    template <typename M, typename R>
    void takePart(const M& m, std::vector<R>& value) {
        const std::size_t most = m.most != nullptr ? limits_.*m.most : std::numeric_limits<std::size_t>::max();
        const ByteSpan records = nextPart(m);
        if constexpr (!HasMembers<R>) {
            value = taken(recordsFrom<R>(records, most));
        } else if constexpr (recordHasTexts<R>()) {
            const ByteSpan texts = nextPart(m);
            value = taken(unpackRecords<R>(records, most, texts));
        } else {
            value = taken(unpackRecords<R>(records, most));
        }
    }
    template <typename M>
    void takeRest(const M& m, std::vector<ByteSlice>& value) {
        const std::size_t left = partCount() - std::min(nextPart_, partCount());
        if (!within(left, limits_.*m.most, m.name)) return;
        value.reserve(left);
        for (; nextPart_ < partCount(); ++nextPart_) value.push_back(bytes(nextPart_));
    }

    const ApplicationLimits& limits_;
    std::size_t nextPart_ = 0;
};

}  // namespace tessera
