#include "server/import/SceneFileCheck.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>

#include <algorithm>

namespace tessera {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedInputStream;

/// Walks the wire format along the schema and counts fields; builds nothing.
class ElementCounter {
public:
    ElementCounter(CodedInputStream& input, const SceneFileLimits& limits, std::size_t bytes)
        : input_(input),
          limits_(limits),
          most_(std::clamp(bytes / limits.bytesPerElement, limits.freeElements, limits.maxElements)) {}

    Expected<void> countMessage(const Descriptor& type, int depth) {
        if (depth > limits_.maxDepth)
            return fail(ErrorCode::kLimit, fmt::format("it is nested deeper than {} levels", limits_.maxDepth));
        while (const std::uint32_t tag = input_.ReadTag()) {
            if (++count_ > most_) return fail(ErrorCode::kLimit, fmt::format("it has more than {} elements", most_));
            const FieldDescriptor* field = type.FindFieldByNumber(WireFormatLite::GetTagFieldNumber(tag));
            const bool lengthDelimited =
                WireFormatLite::GetTagWireType(tag) == WireFormatLite::WIRETYPE_LENGTH_DELIMITED;
            if (lengthDelimited && field != nullptr && field->message_type() != nullptr) {
                const CodedInputStream::Limit outer = input_.ReadLengthAndPushLimit();
                if (Expected<void> inner = countMessage(*field->message_type(), depth + 1); !inner) return inner;
                if (input_.BytesUntilLimit() != 0) return damaged();
                input_.PopLimit(outer);
            } else if (!skip(tag)) {
                return damaged();
            }
        }
        return {};
    }

private:
    /// Groups are not used in the schema: refused, so that skipping needs no recursion.
    bool skip(std::uint32_t tag) {
        switch (WireFormatLite::GetTagWireType(tag)) {
            case WireFormatLite::WIRETYPE_VARINT: {
                std::uint64_t value = 0;
                return input_.ReadVarint64(&value);
            }
            case WireFormatLite::WIRETYPE_FIXED64:
                return input_.Skip(8);
            case WireFormatLite::WIRETYPE_FIXED32:
                return input_.Skip(4);
            case WireFormatLite::WIRETYPE_LENGTH_DELIMITED: {
                std::uint32_t length = 0;
                return input_.ReadVarint32(&length) && length <= 0x7fffffffu && input_.Skip(static_cast<int>(length));
            }
            default:
                return false;
        }
    }

    static tl::unexpected<Error> damaged() {
        return fail(ErrorCode::kBadInput, "it is not a Tessera scene, or damaged");
    }

    CodedInputStream& input_;
    const SceneFileLimits& limits_;
    std::size_t most_;
    std::size_t count_ = 0;
};

}  // namespace

Expected<proto::scene::SceneFile> parseSceneFile(ByteSpan bytes, const SceneFileLimits& limits) {
    if (bytes.size() > 0x7fffffffu) return fail(ErrorCode::kLimit, "it is larger than 2 GiB");
    const auto* data = reinterpret_cast<const std::uint8_t*>(bytes.data());
    const int size = static_cast<int>(bytes.size());
    {
        CodedInputStream input(data, size);
        ElementCounter counter(input, limits, bytes.size());
        if (Expected<void> counted = counter.countMessage(*proto::scene::SceneFile::descriptor(), 0); !counted)
            return tl::unexpected(counted.error());
        if (!input.ConsumedEntireMessage()) return fail(ErrorCode::kBadInput, "it is not a Tessera scene, or damaged");
    }
    CodedInputStream input(data, size);
    input.SetRecursionLimit(limits.maxDepth + 1);
    proto::scene::SceneFile file;
    if (!file.ParseFromCodedStream(&input) || !input.ConsumedEntireMessage())
        return fail(ErrorCode::kBadInput, "it is not a Tessera scene, or damaged");
    return file;
}

}  // namespace tessera
