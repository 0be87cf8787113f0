#include "common/codec/MessageHead.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>

namespace tessera {
namespace {

using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedInputStream;
using google::protobuf::io::CodedOutputStream;

constexpr std::size_t kLongestVarint = 10;
constexpr int kLongestTag = 5;

template <typename Write>
void append(Bytes& bytes, std::size_t atMost, Write&& write) {
    const std::size_t before = bytes.size();
    bytes.resize(before + atMost);
    auto* begin = reinterpret_cast<std::uint8_t*>(bytes.data());
    bytes.resize(static_cast<std::size_t>(write(begin + before) - begin));
}

}  // namespace

void HeadWriter::varint(int number, std::uint64_t value) {
    if (value != 0) varintAlways(number, value);
}
void HeadWriter::fixed(int number, std::uint64_t value) {
    if (value != 0) fixedAlways(number, value);
}
void HeadWriter::text(int number, std::string_view value) {
    if (!value.empty()) textAlways(number, value);
}

void HeadWriter::varintAlways(int number, std::uint64_t value) {
    append(bytes_, 2 * kLongestVarint,
           [&](std::uint8_t* to) { return WireFormatLite::WriteUInt64ToArray(number, value, to); });
}

void HeadWriter::fixedAlways(int number, std::uint64_t value) {
    append(bytes_, kLongestVarint + sizeof value,
           [&](std::uint8_t* to) { return WireFormatLite::WriteFixed64ToArray(number, value, to); });
}

void HeadWriter::textAlways(int number, std::string_view value) {
    append(bytes_, 2 * kLongestVarint, [&](std::uint8_t* to) {
        to = WireFormatLite::WriteTagToArray(number, WireFormatLite::WIRETYPE_LENGTH_DELIMITED, to);
        return CodedOutputStream::WriteVarint32ToArray(static_cast<std::uint32_t>(value.size()), to);
    });
    const ByteSpan bytes = asBytes(value);
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
}

HeadWriter::Opened HeadWriter::open(int number) {
    append(bytes_, kLongestVarint, [&](std::uint8_t* to) {
        return WireFormatLite::WriteTagToArray(number, WireFormatLite::WIRETYPE_LENGTH_DELIMITED, to);
    });
    return {bytes_.size()};
}

void HeadWriter::close(Opened opened) {
    // Its length is known now, and stands before it.
    std::array<std::uint8_t, kLongestVarint> length{};
    const std::uint8_t* end =
        CodedOutputStream::WriteVarint32ToArray(static_cast<std::uint32_t>(bytes_.size() - opened.at), length.data());
    const ByteSpan written = std::as_bytes(std::span(length.data(), static_cast<std::size_t>(end - length.data())));
    bytes_.insert(bytes_.begin() + static_cast<std::ptrdiff_t>(opened.at), written.begin(), written.end());
}

void HeadWriter::varintElement(std::uint64_t value) {
    append(bytes_, kLongestVarint,
           [&](std::uint8_t* to) { return CodedOutputStream::WriteVarint64ToArray(value, to); });
}

void HeadWriter::fixedElement(std::uint64_t value) {
    append(bytes_, sizeof value,
           [&](std::uint8_t* to) { return CodedOutputStream::WriteLittleEndian64ToArray(value, to); });
}

Expected<std::optional<HeadField>> HeadFields::next() {
    if (left_.empty()) return std::optional<HeadField>();
    const auto bad = [] { return fail(ErrorCode::kBadInput, "its head is no protobuf message"); };
    CodedInputStream in(reinterpret_cast<const std::uint8_t*>(left_.data()), static_cast<int>(left_.size()));
    const std::uint32_t tag = in.ReadTag();
    HeadField field{.number = WireFormatLite::GetTagFieldNumber(tag), .bytes = {}};
    // The stream would read a longer one, which classes made from a schema refuse.
    if (field.number == 0 || in.CurrentPosition() > kLongestTag) return bad();
    bool good = false;
    switch (WireFormatLite::GetTagWireType(tag)) {
        case WireFormatLite::WIRETYPE_VARINT:
            field.kind = HeadField::Kind::kVarint;
            good = in.ReadVarint64(&field.value);
            break;
        case WireFormatLite::WIRETYPE_FIXED64:
            field.kind = HeadField::Kind::kFixed;
            good = in.ReadLittleEndian64(&field.value);
            break;
        case WireFormatLite::WIRETYPE_LENGTH_DELIMITED: {
            field.kind = HeadField::Kind::kBytes;
            int length = 0;
            if (!in.ReadVarintSizeAsInt(&length)) return bad();
            const auto begin = static_cast<std::size_t>(in.CurrentPosition());
            good = in.Skip(length);
            if (good) field.bytes = left_.subspan(begin, static_cast<std::size_t>(length));
            break;
        }
        default:
            good = WireFormatLite::SkipField(&in, tag);
    }
    if (!good) return bad();
    left_ = left_.subspan(static_cast<std::size_t>(in.CurrentPosition()));
    return std::optional<HeadField>(field);
}

std::optional<std::uint64_t> takeVarint(ByteSpan& bytes) {
    CodedInputStream in(reinterpret_cast<const std::uint8_t*>(bytes.data()), static_cast<int>(bytes.size()));
    std::uint64_t value = 0;
    if (!in.ReadVarint64(&value)) return std::nullopt;
    bytes = bytes.subspan(static_cast<std::size_t>(in.CurrentPosition()));
    return value;
}

Expected<HeadReader> HeadReader::read(ByteSpan head) {
    HeadReader read;
    HeadFields fields(head);
    for (;;) {
        const Expected<std::optional<HeadField>> next = fields.next();
        if (!next) return tl::unexpected(next.error());
        if (!*next) return read;
        const HeadField& field = **next;
        if (field.number > kMostHeadFields) continue;
        Field& into = read.fields_[static_cast<std::size_t>(field.number)];
        if (field.kind == HeadField::Kind::kVarint) into.varint = field.value;
        if (field.kind == HeadField::Kind::kFixed) into.fixed = field.value;
        if (field.kind == HeadField::Kind::kBytes) into.text = asText(field.bytes);
    }
}

std::uint64_t HeadReader::varint(int number) const {
    return fields_[static_cast<std::size_t>(number)].varint;
}

std::uint64_t HeadReader::fixed(int number) const {
    return fields_[static_cast<std::size_t>(number)].fixed;
}

std::string_view HeadReader::text(int number) const {
    return fields_[static_cast<std::size_t>(number)].text;
}

}  // namespace tessera
