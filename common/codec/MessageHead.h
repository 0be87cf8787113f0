/// The head of a message as protobuf's bytes, written and read field by field: what a message consists of says its
/// description (common/session/MessageFields.h, common/request/Members.h), and no class is generated from the schema
/// for it. Not for other modules.
#pragma once

#include <array>
#include <cstring>
#include <optional>
#include <string_view>

#include "common/base/Bytes.h"
#include "common/base/Error.h"
#include "common/session/MessageFields.h"

namespace tessera {

/// Writes the bytes that protobuf's proto3 writes: fields in the order of the calls, none that is zero or empty.
class HeadWriter {
public:
    void varint(int number, std::uint64_t value);
    void fixed(int number, std::uint64_t value);
    void text(int number, std::string_view value);

    // The same, and written where it is zero or empty, too: what may be absent, and elements of what may be many.
    void varintAlways(int number, std::uint64_t value);
    void fixedAlways(int number, std::uint64_t value);
    void textAlways(int number, std::string_view value);

    /// What is written up to `close` is a message within this one, or an array of numbers. One within the other.
    struct Opened {
        std::size_t at = 0;
    };
    [[nodiscard]] Opened open(int number);
    void close(Opened opened);
    // Elements of an array.
    void varintElement(std::uint64_t value);
    void fixedElement(std::uint64_t value);

    [[nodiscard]] const Bytes& bytes() const { return bytes_; }

private:
    Bytes bytes_;
};

/// A field of a head.
struct HeadField {
    enum class Kind : std::uint8_t { kVarint, kFixed, kBytes, kOther };
    int number = 0;
    Kind kind = Kind::kOther;
    std::uint64_t value = 0;  ///< kVarint, kFixed
    ByteSpan bytes;           ///< kBytes: a text, a message within this one, or an array
};

/// One field of a head after the other, in the order of their bytes.
class HeadFields {
public:
    /// `head` must live as long as this, and the bytes of its fields.
    explicit HeadFields(ByteSpan head) : left_(head) {}

    /// Nothing at the end. kBadInput: it is no protobuf message.
    [[nodiscard]] Expected<std::optional<HeadField>> next();

private:
    ByteSpan left_;
};
/// The first number of an array, which is taken away from it; nothing where there is none.
[[nodiscard]] std::optional<std::uint64_t> takeVarint(ByteSpan& bytes);
/// The elements of an array, `take` for each, until it says false. False: they end in the middle of one.
template <typename Take>
bool eachVarint(ByteSpan bytes, Take&& take) {
    while (!bytes.empty()) {
        const std::optional<std::uint64_t> value = takeVarint(bytes);
        if (!value) return false;
        if (!take(*value)) return true;
    }
    return true;
}
template <typename Take>
bool eachFixed(ByteSpan bytes, Take&& take) {
    for (; bytes.size() >= sizeof(std::uint64_t); bytes = bytes.subspan(sizeof(std::uint64_t))) {
        std::uint64_t value = 0;
        std::memcpy(&value, bytes.data(), sizeof value);
        if (!take(value)) return true;
    }
    return bytes.empty();
}

/// Reads what protobuf would: fields in any order, the last of a number counts, one of an unknown number or of another
/// kind than asked for is as if it were not there.
class HeadReader {
public:
    /// `head` must live as long as what is asked. kBadInput: it is no protobuf message.
    [[nodiscard]] static Expected<HeadReader> read(ByteSpan head);

    [[nodiscard]] std::uint64_t varint(int number) const;
    [[nodiscard]] std::uint64_t fixed(int number) const;
    [[nodiscard]] std::string_view text(int number) const;

private:
    /// The last of each kind, by whichever of them is asked for.
    struct Field {
        std::uint64_t varint = 0, fixed = 0;
        std::string_view text;
    };
    std::array<Field, kMostHeadFields + 1> fields_;
};

}  // namespace tessera
