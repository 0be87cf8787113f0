/// The bytes of a recording: read to its end, its cut or its first error.
#include "common/scene/FieldTable.h"
#include "server/sim/recording/RecordingReader.h"
#include "tests/fuzz/FuzzInput.h"

namespace tessera::fuzz {
namespace {

/// Records of any content under headers that are right, behind an opening that this program accepts; or whatever the
/// bytes are.
Bytes recording(FuzzInput& in) {
    if (in.below(4) == 0) {
        const ByteSpan bytes = in.rest();
        return {bytes.begin(), bytes.end()};
    }
    Bytes all;
    std::uint64_t number = 0;
    const auto append = [&](std::uint64_t kind, ByteSpan content) {
        const RecordHeader header = headerFor(kind, content, number++);
        const auto head = std::as_bytes(std::span(&header, 1));
        all.insert(all.end(), head.begin(), head.end());
        all.insert(all.end(), content.begin(), content.end());
    };
    const RecordContent opening = encodeOpening({.schema = schemaHash(), .program = "fuzz", .instructionSet = "none"});
    append(opening.kind, opening.bytes());
    while (!in.empty()) {
        const std::size_t kind = in.below(8);
        append(kind, in.bytes(in.number<std::uint16_t>()));
    }
    return all;
}

void run(FuzzInput in) {
    const Bytes bytes = recording(in);
    Expected<RecordingReader> reader = RecordingReader::over(bytes, "fuzz.rec");
    while (reader) {
        const Expected<RecordingReader::Item> item = reader->next();
        if (!item) return must(!item.error().message.empty(), "a refusal has words");
        if (const auto* cut = std::get_if<RecordingReader::CutOff>(&*item))
            return must(cut->lastWholeBytes <= bytes.size(), "a cut lies in the file");
        if (std::holds_alternative<record::Closing>(*item)) return;
    }
}

}  // namespace
}  // namespace tessera::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    tessera::fuzz::run({data, size});
    return 0;
}
