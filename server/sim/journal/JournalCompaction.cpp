#include "server/sim/journal/JournalCompaction.h"

#include <algorithm>
#include <cstring>
#include <unordered_set>
#include <utility>

#include <fmt/format.h>

#include "common/base/HashStreams.h"
#include "server/sim/journal/JournalStory.h"

namespace tessera {
namespace {

/// A snapshot under way.
class SnapshotWriter {
public:
    SnapshotWriter(JournalFile file, JournalPlaces& places, const std::atomic<bool>& stop)
        : file_(std::move(file)), places_(places), stop_(stop) {}

    [[nodiscard]] Expected<void> write(JournalRecord record) {
        if (auto* step = std::get_if<journal::Step>(&record))
            for (ChangeListPtr& list : step->kept.lists) {
                if (Expected<void> there = appendArraysOf(*list); !there) return there;
                Expected<ChangeListPtr> whole = places_.withRanges(std::move(list));
                if (!whole) return tl::unexpected(whole.error());
                list = std::move(*whole);
            }
        if (const auto* state = std::get_if<journal::State>(&record))
            if (Expected<void> there = appendArraysOf(*state->list); !there) return there;
        const RecordContent content = encodeJournal(std::exchange(record, journal::Array{}));
        if (const int error = file_.append(content)) return fail(ErrorCode::kFailed, std::strerror(error));
        return {};
    }
    [[nodiscard]] const JournalFile& file() const { return file_; }

private:
    static constexpr std::uint64_t kPiece = std::uint64_t{1} << 20;

    [[nodiscard]] Expected<void> appendArraysOf(const ChangeList& list) {
        for (const Blob& array : blobsOf(list))
            if (written_.insert(array.id()).second)
                if (Expected<void> there = append(array); !there)
                    return failWith(fmt::format("the array {}", toHex(array.id())), there.error());
        return {};
    }

    [[nodiscard]] Expected<void> append(const Blob& array) {
        const FiledArray* filed = places_.find(array.id());
        if (!filed || filed->bytes() != array.sizeBytes()) return fail(ErrorCode::kFailed, "it is in no file");
        // A record begins with the hash of its content, so what edits of ranges have made is read twice.
        std::uint64_t hash = 0;
        if (filed->contentHash) {
            hash = *filed->contentHash;
        } else {
            Hash64Stream content;
            BlobIdStream id;
            for (std::uint64_t at = 0; at < filed->bytes(); at += buffer_.size()) {
                const Expected<ByteSpan> piece = read(*filed, at);
                if (!piece) return tl::unexpected(piece.error());
                content.add(*piece);
                id.add(*piece);
            }
            if (id.id() != array.id())
                return fail(ErrorCode::kFailed, fmt::format("its ranges lead to {}", toHex(id.id())));
            hash = content.hash();
        }
        Hash64Stream copied;
        return file_.append({.bytes = filed->bytes(), .kind = kindOfArrays(), .contentHash = hash, .headerHash = 0},
                            [&](std::uint64_t at) -> Expected<ByteSpan> {
                                const Expected<ByteSpan> piece = read(*filed, at);
                                if (piece) copied.add(*piece);
                                if (piece && at + piece->size() == filed->bytes() && copied.hash() != hash)
                                    return fail(ErrorCode::kFailed, "its bytes have changed in their file");
                                return piece;
                            });
    }
    [[nodiscard]] Expected<ByteSpan> read(const FiledArray& array, std::uint64_t at) {
        if (stop_) return fail(ErrorCode::kFailed, "it was stopped");
        const auto piece = std::span(buffer_).first(std::min<std::uint64_t>(buffer_.size(), array.bytes() - at));
        if (const Expected<void> done = array.readInto(piece, at); !done) return tl::unexpected(done.error());
        return ByteSpan(piece);
    }

    JournalFile file_;
    JournalPlaces& places_;
    const std::atomic<bool>& stop_;
    std::unordered_set<BlobId> written_;
    Bytes buffer_ = Bytes(kPiece);
};

}  // namespace

Expected<std::uint64_t> compactJournal(const JournalFolder& folder, std::uint64_t upTo, const JournalLimits& limits,
                                       const std::atomic<bool>& stop) {
    const Expected<JournalFiles> files = folder.files();
    if (!files) return tl::unexpected(files.error());
    JournalPlaces places;
    Expected<JournalStory> story = readJournal(folder, *files, places, limits, upTo, stop);
    if (!story) return tl::unexpected(story.error());
    JournalState& state = story->state;

    Expected<JournalFile> file = folder.beginSnapshot({.schema = state.schema,
                                                       .program = state.program,
                                                       .number = upTo,
                                                       .epoch = state.epoch,
                                                       .scenes = state.scenes,
                                                       .sequence = {},
                                                       .stateHash = Aspect().stateHash(),
                                                       .before = {.opening = story->before.opening}});
    if (!file) return tl::unexpected(file.error());
    SnapshotWriter writer(std::move(*file), places, stop);
    Expected<void> written;
    std::move(state).forEachRecord([&](JournalRecord record) {
        written = writer.write(std::move(record));
        return written.has_value() && !stop.load();
    });
    if (!written || stop) {
        folder.dropSnapshot(upTo);
        return fail(ErrorCode::kFailed, fmt::format("{}: the snapshot cannot be written: {}", folder.snapshotPath(upTo),
                                                    stop ? "it was stopped" : written.error().message));
    }
    // Only once the snapshot is there for good may go what it was made of.
    if (Expected<void> there = folder.finishSnapshot(writer.file(), upTo); !there) return tl::unexpected(there.error());
    for (const std::string& old : files->leftOver) folder.remove(old);
    if (files->snapshot && *files->snapshot != upTo) folder.remove(folder.snapshotPath(*files->snapshot));
    for (const std::uint64_t log : files->logs)
        if (log < upTo) folder.remove(folder.logPath(log));
    return writer.file().bytes();
}

}  // namespace tessera
