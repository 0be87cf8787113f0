/// Described records (common/request/Members.h) as the parts of messages: of fixed size, little-endian, one behind the
/// other, with their texts in a part of their own. Not for other modules.
#pragma once

#include <array>
#include <cstring>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include <fmt/format.h>

#include "common/base/Bytes.h"
#include "common/base/Error.h"
#include "common/request/Members.h"

namespace tessera {

// ---- numbers of any type as 64 bits

template <typename T>
[[nodiscard]] std::uint64_t wireNumber(T value) {
    if constexpr (kIsId<T>)
        return value.value;
    else
        return static_cast<std::uint64_t>(value);
}
/// Nothing where `number` is no T.
template <typename T>
[[nodiscard]] std::optional<T> wireValue(std::uint64_t number) {
    if constexpr (std::is_same_v<T, bool>) {
        return number != 0;
    } else if constexpr (kIsId<T>) {
        if (number > std::numeric_limits<decltype(T{}.value)>::max()) return std::nullopt;
        return T(static_cast<decltype(T{}.value)>(number));
    } else if constexpr (std::is_enum_v<T>) {
        if (number >= WordsOf<T>::kWords.size()) return std::nullopt;
        return static_cast<T>(number);
    } else {
        if (number > std::numeric_limits<T>::max()) return std::nullopt;
        return static_cast<T>(number);
    }
}

// ---- records

/// Writes records one behind the other, and their texts beside them.
class RecordWriter {
public:
    template <HasMembers R>
    explicit RecordWriter(std::span<const R> records) : bytes_(records.size() * recordSize<R>()), to_(bytes_.data()) {
        for (const R& record : records) put(record);
    }
    [[nodiscard]] Bytes& bytes() { return bytes_; }
    [[nodiscard]] Bytes& texts() { return texts_; }

private:
    template <typename T>
    void raw(const T& value) {
        std::memcpy(to_, &value, sizeof value);
        to_ += sizeof value;
    }
    template <typename T>
    void put(const T& value) {
        constexpr ValueKind kind = valueKindOf<T>();
        if constexpr (kind == ValueKind::kBool || kind == ValueKind::kWord) {
            raw(static_cast<std::uint32_t>(value));
        } else if constexpr (kind == ValueKind::kText) {
            raw(static_cast<std::uint32_t>(value.size()));
            const ByteSpan text = asBytes(value);
            texts_.insert(texts_.end(), text.begin(), text.end());
        } else if constexpr (kind == ValueKind::kPlace || kind == ValueKind::kVector) {
            for (const double each : value) raw(each);
        } else if constexpr (kind == ValueKind::kRotation) {
            raw(std::array{value.w(), value.x(), value.y(), value.z()});
        } else if constexpr (kind == ValueKind::kValue) {
            forEachMember<T>([&]<typename M>(const M&) {
                if constexpr (M::kForm == MemberForm::kReserved)
                    to_ += M::kBytes;
                else
                    put(M::of(value));
            });
        } else {
            raw(value);
        }
    }

    Bytes bytes_, texts_;
    std::byte* to_;
};

/// Reads them; keeps the first thing that is wrong.
class RecordReader {
public:
    RecordReader(ByteSpan bytes, ByteSpan texts) : from_(bytes.data()), texts_(texts) {}

    [[nodiscard]] const char* fault() const { return fault_; }
    [[nodiscard]] ByteSpan textsLeft() const { return texts_; }
    template <typename T>
    void take(T& value) {
        constexpr ValueKind kind = valueKindOf<T>();
        if constexpr (kind == ValueKind::kBool) {
            const auto number = raw<std::uint32_t>();
            check(number <= 1, "a flag that is neither 0 nor 1");
            value = number == 1;
        } else if constexpr (kind == ValueKind::kWord) {
            const std::optional<T> word = wireValue<T>(raw<std::uint32_t>());
            check(word.has_value(), "a word that this version does not know");
            value = word.value_or(T{});
        } else if constexpr (kind == ValueKind::kText) {
            const std::size_t size = raw<std::uint32_t>();
            check(size <= texts_.size(), "texts that end before their records do");
            value = asText(texts_.first(std::min(size, texts_.size())));
            texts_ = texts_.subspan(value.size());
        } else if constexpr (kind == ValueKind::kPlace || kind == ValueKind::kVector) {
            for (double& each : value) each = raw<double>();
        } else if constexpr (kind == ValueKind::kRotation) {
            const auto q = raw<std::array<double, 4>>();
            value = Quatd(q[0], q[1], q[2], q[3]);
        } else if constexpr (kind == ValueKind::kValue) {
            forEachMember<T>([&]<typename M>(const M&) {
                if constexpr (M::kForm == MemberForm::kReserved)
                    check(raw<std::array<std::byte, M::kBytes>>() == std::array<std::byte, M::kBytes>{},
                          "bytes in use that this version does not know");
                else
                    take(M::of(value));
            });
        } else {
            value = raw<T>();
        }
    }

private:
    template <typename T>
    T raw() {
        T value;
        std::memcpy(&value, from_, sizeof value);
        from_ += sizeof value;
        return value;
    }
    void check(bool right, const char* otherwise) {
        if (!right && !fault_) fault_ = otherwise;
    }

    const std::byte* from_;
    ByteSpan texts_;
    const char* fault_ = nullptr;
};

/// At most `most`, counted before memory is taken (kLimit). kBadInput: a broken record, one that says what cannot be,
/// texts that are not as long as the records say. Of their members' bounds asks `findFault`.
template <HasMembers R>
[[nodiscard]] Expected<std::vector<R>> unpackRecords(ByteSpan bytes, std::size_t most, ByteSpan texts = {}) {
    constexpr std::size_t kSize = recordSize<R>();
    if (bytes.size() % kSize != 0) return fail(ErrorCode::kBadInput, "an array ends in the middle of an entry");
    const std::size_t count = bytes.size() / kSize;
    if (count > most)
        return fail(ErrorCode::kLimit, fmt::format("an array of {} entries; at most {} are allowed", count, most));
    std::vector<R> records(count);
    RecordReader in(bytes, texts);
    for (R& record : records) {
        in.take(record);
        if (in.fault()) return fail(ErrorCode::kBadInput, in.fault());
    }
    if (!in.textsLeft().empty()) return fail(ErrorCode::kBadInput, "texts that belong to no record");
    return records;
}

}  // namespace tessera
