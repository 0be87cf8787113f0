#include "common/codec/MessageHead.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>

namespace tessera {
namespace {

using google::protobuf::io::CodedInputStream;
using google::protobuf::io::CodedOutputStream;
using google::protobuf::internal::WireFormatLite;

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
    if (value == 0) return;
    append(bytes_, 2 * kLongestVarint,
           [&](std::uint8_t* to) { return WireFormatLite::WriteUInt64ToArray(number, value, to); });
}

void HeadWriter::fixed(int number, std::uint64_t value) {
    if (value == 0) return;
    append(bytes_, kLongestVarint + sizeof value,
           [&](std::uint8_t* to) { return WireFormatLite::WriteFixed64ToArray(number, value, to); });
}

void HeadWriter::text(int number, std::string_view value) {
    if (value.empty()) return;
    append(bytes_, 2 * kLongestVarint, [&](std::uint8_t* to) {
        to = WireFormatLite::WriteTagToArray(number, WireFormatLite::WIRETYPE_LENGTH_DELIMITED, to);
        return CodedOutputStream::WriteVarint32ToArray(static_cast<std::uint32_t>(value.size()), to);
    });
    const ByteSpan bytes = asBytes(value);
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
}

Expected<HeadReader> HeadReader::read(ByteSpan head) {
    const auto bad = [] { return fail(ErrorCode::kBadInput, "its head is no protobuf message"); };
    HeadReader read;
    CodedInputStream in(reinterpret_cast<const std::uint8_t*>(head.data()), static_cast<int>(head.size()));
    while (static_cast<std::size_t>(in.CurrentPosition()) < head.size()) {
        const int before = in.CurrentPosition();
        const std::uint32_t tag = in.ReadTag();
        const int number = WireFormatLite::GetTagFieldNumber(tag);
        // The stream would read a longer one, which classes made from a schema refuse.
        if (number == 0 || in.CurrentPosition() > before + kLongestTag) return bad();
        Field ignored;
        Field& field = number <= kMostHeadFields ? read.fields_[static_cast<std::size_t>(number)] : ignored;
        bool good = false;
        switch (WireFormatLite::GetTagWireType(tag)) {
            case WireFormatLite::WIRETYPE_VARINT:
                good = in.ReadVarint64(&field.varint);
                break;
            case WireFormatLite::WIRETYPE_FIXED64:
                good = in.ReadLittleEndian64(&field.fixed);
                break;
            case WireFormatLite::WIRETYPE_LENGTH_DELIMITED: {
                int length = 0;
                if (!in.ReadVarintSizeAsInt(&length)) return bad();
                const auto begin = static_cast<std::size_t>(in.CurrentPosition());
                good = in.Skip(length);
                if (good) field.text = asText(head.subspan(begin, static_cast<std::size_t>(length)));
                break;
            }
            default:
                good = WireFormatLite::SkipField(&in, tag);
        }
        if (!good) return bad();
    }
    return read;
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
