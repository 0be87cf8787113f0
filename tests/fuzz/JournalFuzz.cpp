/// The bytes of a journal's file: read to its end, its torn end or its first error, and what it leads to.
#include "common/scene/FieldTable.h"
#include "server/sim/journal/JournalReader.h"
#include "server/sim/journal/JournalState.h"
#include "tests/fuzz/FuzzInput.h"

namespace tessera::fuzz {
namespace {

/// Records of any content under headers that are right, behind an opening that this program accepts; or whatever the
/// bytes are.
Bytes journalFile(FuzzInput& in) {
    const auto way = in.below(4);
    if (way == 0) {
        const ByteSpan bytes = in.rest();
        return {bytes.begin(), bytes.end()};
    }
    const std::uint32_t format = way == 2 ? 2 : kJournalFormat;
    const ByteSpan mark = asBytes(kJournalMark);
    Bytes all(mark.begin(), mark.end());
    std::uint64_t number = 0;
    JournalHeaders headers;
    const auto append = [&](std::uint64_t kind, ByteSpan content) {
        const RecordHeader header = headers.make(kind, content.size(), hash64(content), number++);
        const auto head = std::as_bytes(std::span(&header, 1));
        all.insert(all.end(), head.begin(), head.end());
        all.insert(all.end(), content.begin(), content.end());
    };
    const RecordContent opening = encodeJournal(journal::Opening{.schema = schemaHash(),
                                                                 .program = "fuzz",
                                                                 .number = 1,
                                                                 .epoch = Epoch(1),
                                                                 .scenes = {},
                                                                 .sequence = {},
                                                                 .stateHash = Aspect().stateHash(),
                                                                 .format = format});
    append(opening.kind, opening.bytes());
    headers = JournalHeaders(format, hash64(opening.bytes()));
    while (!in.empty()) {
        const std::size_t kind = in.below(std::variant_size_v<JournalRecord>);
        append(kind, in.bytes(in.number<std::uint16_t>()));
    }
    return all;
}

/// The same bytes as who makes a snapshot of them reads them; nothing where they are refused.
std::optional<StateHash> hashWithoutArrays(Bytes bytes) {
    JournalPlaces places;
    Expected<JournalReader> reader = JournalReader::over(std::move(bytes), "fuzz", places);
    JournalState state;
    while (reader) {
        Expected<std::optional<JournalRecord>> record = reader->next();
        if (!record) break;
        if (!*record) return state.scene.stateHash();
        const auto* frame = std::get_if<journal::Frame>(&**record);
        if (frame && frame->list && !places.comes(*frame->list, state.scene, reader->ranges())) break;
        if (!state.take(std::move(**record))) break;
        places.sweep(state.history);
    }
    return std::nullopt;
}

void run(FuzzInput in) {
    Bytes bytes = journalFile(in);
    const std::optional<StateHash> withoutArrays = hashWithoutArrays(bytes);
    const std::size_t size = bytes.size();
    BlobStore arrays;
    Expected<JournalReader> reader = JournalReader::over(std::move(bytes), "fuzz", arrays);
    if (!reader) return must(!reader.error().message.empty(), "a refusal has words");
    JournalState state;
    while (true) {
        Expected<std::optional<JournalRecord>> record = reader->next();
        if (!record) return must(!record.error().message.empty(), "a refusal has words");
        must(reader->wholeBytes() <= size, "whole records lie in the file");
        if (!*record) break;
        if (const Expected<void> taken = state.take(std::move(**record)); !taken)
            return must(!taken.error().message.empty(), "a refusal has words");
    }
    must(withoutArrays == state.scene.stateHash(), "whoever leaves the arrays where they are reads the same");
    // What a journal leads to can be kept again, and is the same.
    BlobStore more;
    std::vector<Blob> held;
    JournalState again;
    const StateHash hash = state.scene.stateHash();
    const std::size_t depth = state.history.undoDepth();
    std::move(state).forEachRecord([&](const JournalRecord& record) {
        const auto hold = [&](const ChangeListPtr& list) {
            for (const Blob& blob : blobsOf(*list)) held.push_back(more.add(blob));
        };
        if (const auto* step = std::get_if<journal::Step>(&record))
            for (const ChangeListPtr& list : step->kept.lists) hold(list);
        if (const auto* whole = std::get_if<journal::State>(&record)) hold(whole->list);
        const RecordContent content = encodeJournal(record);
        const ByteSpan written = content.bytes();
        Expected<JournalRecord> read = decodeJournal(content.kind, {written.begin(), written.end()}, more);
        must(read.has_value(), "what is kept can be read");
        must(again.take(std::move(*read)).has_value(), "what is kept can be taken");
        return true;
    });
    must(again.scene.stateHash() == hash, "the scene is the same");
    must(again.history.undoDepth() == depth, "so is the history");
}

}  // namespace
}  // namespace tessera::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    tessera::fuzz::run({data, size});
    return 0;
}
