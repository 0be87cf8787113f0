#include "common/codec/MessageHead.h"

#include <cstring>
#include <optional>

namespace tessera {
namespace {

/// Of protobuf's encoding (protobuf.dev/programming-guides/encoding): a tag is the field's number and one of these.
enum WireKind : std::uint64_t { kVarint = 0, kFixed64 = 1, kLengthDelimited = 2, kFixed32 = 5 };
constexpr int kKindBits = 3;
constexpr std::uint64_t tagOf(int number, WireKind kind) {
    return static_cast<std::uint64_t>(number) << kKindBits | kind;
}

/// What is left of a head.
class Rest {
public:
    explicit Rest(ByteSpan bytes) : bytes_(bytes) {}

    [[nodiscard]] bool empty() const { return bytes_.empty(); }
    std::optional<ByteSpan> take(std::uint64_t count) {
        if (count > bytes_.size()) return std::nullopt;
        const ByteSpan taken = bytes_.first(count);
        bytes_ = bytes_.subspan(count);
        return taken;
    }
    std::optional<std::uint64_t> varint() {
        std::uint64_t value = 0;
        for (int shift = 0; shift < 70; shift += 7) {
            const auto byte = take(1);
            if (!byte) return std::nullopt;
            const auto bits = static_cast<std::uint64_t>(byte->front());
            value |= (bits & 0x7f) << shift;  // of a tenth byte the lowest bit counts
            if (bits < 0x80) return value;
        }
        return std::nullopt;
    }
    std::optional<std::uint64_t> fixed64() {
        const auto bytes = take(8);
        if (!bytes) return std::nullopt;
        std::uint64_t value = 0;
        std::memcpy(&value, bytes->data(), sizeof value);
        return value;
    }

private:
    ByteSpan bytes_;
};

}  // namespace

void HeadWriter::raw(std::uint64_t value) {
    for (; value >= 0x80; value >>= 7) bytes_.push_back(static_cast<std::byte>(value | 0x80));
    bytes_.push_back(static_cast<std::byte>(value));
}

void HeadWriter::varint(int number, std::uint64_t value) {
    if (value == 0) return;
    raw(tagOf(number, kVarint));
    raw(value);
}

void HeadWriter::fixed(int number, std::uint64_t value) {
    if (value == 0) return;
    raw(tagOf(number, kFixed64));
    const ByteSpan bytes = std::as_bytes(std::span(&value, 1));
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
}

void HeadWriter::text(int number, std::string_view value) {
    if (value.empty()) return;
    raw(tagOf(number, kLengthDelimited));
    raw(value.size());
    const ByteSpan bytes = asBytes(value);
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
}

Expected<HeadReader> HeadReader::read(ByteSpan head) {
    HeadReader read;
    const auto bad = [] { return fail(ErrorCode::kBadInput, "its head is no protobuf message"); };
    for (Rest rest(head); !rest.empty();) {
        const auto tag = rest.varint();
        if (!tag || *tag >> kKindBits == 0) return bad();
        Field field;
        switch (*tag & ((1u << kKindBits) - 1)) {
            case kVarint: {
                const auto value = rest.varint();
                if (!value) return bad();
                field = {Kind::kVarint, *value, {}};
                break;
            }
            case kFixed64: {
                const auto value = rest.fixed64();
                if (!value) return bad();
                field = {Kind::kFixed, *value, {}};
                break;
            }
            case kLengthDelimited: {
                const auto length = rest.varint();
                const auto bytes = length ? rest.take(*length) : std::nullopt;
                if (!bytes) return bad();
                field = {Kind::kText, 0, asText(*bytes)};
                break;
            }
            case kFixed32:  // no message has one
                if (!rest.take(4)) return bad();
                break;
            default:
                return bad();
        }
        if (const std::uint64_t number = *tag >> kKindBits; number <= kMostHeadFields) read.fields_[number] = field;
    }
    return read;
}

std::uint64_t HeadReader::varint(int number) const {
    const Field& field = fields_[static_cast<std::size_t>(number)];
    return field.kind == Kind::kVarint ? field.number : 0;
}

std::uint64_t HeadReader::fixed(int number) const {
    const Field& field = fields_[static_cast<std::size_t>(number)];
    return field.kind == Kind::kFixed ? field.number : 0;
}

std::string_view HeadReader::text(int number) const {
    const Field& field = fields_[static_cast<std::size_t>(number)];
    return field.kind == Kind::kText ? field.text : std::string_view();
}

}  // namespace tessera
