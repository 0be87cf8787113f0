#include "server/sim/journal/JournalStory.h"

#include <string>
#include <type_traits>

#include <fmt/format.h>

#include "server/sim/journal/JournalReader.h"

namespace tessera {
namespace {

/// A file of the journal as it is read.
struct FileInOrder {
    bool isSnapshot = false;
    std::string before;             ///< the log before it
    std::uint64_t bytesBefore = 0;  ///< that it has
};

/// Whether a record of this kind stands in such a file.
bool belongsThere(const JournalRecord& record, bool inSnapshot) {
    if (std::holds_alternative<journal::Opening>(record) || std::holds_alternative<journal::View>(record) ||
        std::holds_alternative<journal::Numbers>(record))
        return true;
    return inSnapshot ==
           (std::holds_alternative<journal::Step>(record) || std::holds_alternative<journal::State>(record));
}

Expected<void> fitsBehind(const journal::Opening& opening, const FileInOrder& file) {
    if (opening.earlierBytes == 0 || file.before.empty() || opening.earlierBytes == file.bytesBefore) return {};
    return fail(ErrorCode::kBadInput,
                fmt::format("{}: it has {} bytes; when the next log was begun, it had {}. Put back a copy of it",
                            file.before, file.bytesBefore, opening.earlierBytes));
}

/// Reads a file to its end. The reader is left there. `places`: the reader's, or null.
Expected<void> takeAll(JournalReader& reader, const FileInOrder& file, JournalState& state, JournalPlaces* places,
                       const std::atomic<bool>* stop) {
    bool ended = false;
    while (true) {
        if (stop && *stop) return fail(ErrorCode::kFailed, "it was stopped");
        Expected<std::optional<JournalRecord>> record = reader.next();
        if (!record) return tl::unexpected(record.error());
        if (!*record) break;
        if (ended || !belongsThere(**record, file.isSnapshot))
            return fail(ErrorCode::kBadInput, fmt::format("{}: it is out of place in a {}", reader.where(),
                                                          file.isSnapshot ? "snapshot" : "log"));
        ended = std::holds_alternative<journal::State>(**record);
        if (const auto* opening = std::get_if<journal::Opening>(&**record))
            if (Expected<void> fits = fitsBehind(*opening, file); !fits) return fits;
        const auto* frame = places ? std::get_if<journal::Frame>(&**record) : nullptr;
        if (frame && frame->list)
            if (const Expected<void> known = places->comes(*frame->list, state.scene, reader.ranges()); !known)
                return failWith(reader.where(), known.error());
        if (const Expected<void> taken = state.take(std::move(**record)); !taken)
            return failWith(reader.where(), taken.error());
        if (places) places->sweep(state.history);
    }
    if (!file.isSnapshot || (ended && reader.bytesLeft() == 0)) return {};
    return fail(ErrorCode::kBadInput, reader.where() + ": the snapshot's end is missing. Put back a copy of it");
}

Expected<void> wholeOrRefused(const JournalReader& reader) {
    if (reader.bytesLeft() == 0) return {};
    return fail(ErrorCode::kBadInput,
                reader.where() + ": the log is cut off there, and others follow it. Put back a copy of it");
}

/// All that `last` tells of has to be there.
Expected<void> reachesItsEnd(const JournalReader& reader, std::uint64_t certain, const std::string& cure) {
    if (reader.wholeBytes() >= certain) return {};
    return fail(ErrorCode::kBadInput, fmt::format("{}: it is not whole, and edits are granted up to byte {}. Put back "
                                                  "a copy of the log; or, to go on without them, {}",
                                                  reader.where(), certain, cure));
}

/// `kept`: the arrays, or their places.
template <typename Kept>
Expected<JournalStory> read(const JournalFolder& folder, const JournalFiles& files, Kept& kept,
                            const JournalLimits& limits, std::optional<std::uint64_t> upTo,
                            const std::atomic<bool>* stop) {
    JournalPlaces* places = nullptr;
    if constexpr (std::is_same_v<Kept, JournalPlaces>) places = &kept;
    JournalStory story;
    if (files.snapshot) {
        Expected<JournalReader> reader = JournalReader::open(folder.snapshotPath(*files.snapshot), kept, limits);
        if (!reader) return tl::unexpected(reader.error());
        if (Expected<void> taken = takeAll(*reader, {.isSnapshot = true}, story.state, places, stop); !taken)
            return tl::unexpected(taken.error());
        story.snapshotBytes = reader->wholeBytes();
        if (story.state.number != *files.snapshot)
            return fail(ErrorCode::kBadInput, reader->name() + ": it is the snapshot of another log");
    }
    FileInOrder file;
    for (const std::uint64_t number : files.logs) {
        if (upTo && number >= *upTo) break;
        Expected<JournalReader> reader = JournalReader::open(folder.logPath(number), kept, limits);
        if (!reader) return tl::unexpected(reader.error());
        const bool isLast = number == files.lastLog();
        const JournalEnd::Extent* const extent =
            isLast && files.isNamed(number) && files.end->extent ? &*files.end->extent : nullptr;
        const bool powerWasCut = extent && !extent->isOf(folder.disk().calls().boot());
        if (powerWasCut) reader->mayLackRecordsFrom(extent->synced);
        if (Expected<void> taken = takeAll(*reader, file, story.state, places, stop); !taken)
            return tl::unexpected(taken.error());
        story.logBytes += reader->wholeBytes();
        story.bytesBefore = file.bytesBefore;
        story.wholeBytes = reader->wholeBytes();
        story.tornBytes = reader->bytesLeft();
        story.hollow = story.wholeBytes <= kJournalMark.size();
        if (!story.hollow && story.state.number != number)
            return fail(ErrorCode::kBadInput, fmt::format("{}: it is log {}", reader->name(), story.state.number));
        if (isLast) {
            // It is named once its opening is on the disk, and before anything else is in it.
            if (story.hollow && (!files.end || files.isNamed(number)))
                return fail(ErrorCode::kBadInput,
                            fmt::format("{}: it is cut off within its opening, and the journal's newest edits were "
                                        "behind that. Put back a copy of it; or, to go on without it, remove it and {}",
                                        reader->name(), folder.last().cure(number - 1)));
            if (extent)
                if (Expected<void> whole = reachesItsEnd(*reader, powerWasCut ? extent->synced : extent->written,
                                                         folder.last().cure(number));
                    !whole)
                    return tl::unexpected(whole.error());
            story.afterPowerCut = powerWasCut && story.wholeBytes < extent->written;
            break;
        }
        if (Expected<void> whole = wholeOrRefused(*reader); !whole || story.hollow)
            return whole ? fail(ErrorCode::kBadInput, reader->name() + ": nothing is in it, and other logs follow it")
                         : tl::unexpected(whole.error());
        file.before = reader->name();
        file.bytesBefore = story.wholeBytes;
    }
    // Each start writes one before its log.
    if (!upTo && !files.end && story.state.format >= 3)
        return fail(ErrorCode::kBadInput,
                    fmt::format("{} is missing: it tells how far the journal goes. Put it back; or, to go on with the "
                                "logs that are there, {}",
                                folder.last().path(), folder.last().cure(files.lastLog())));
    return story;
}

}  // namespace

Expected<JournalStory> readJournal(const JournalFolder& folder, const JournalFiles& files, BlobStore& arrays,
                                   const JournalLimits& limits, std::optional<std::uint64_t> upTo,
                                   const std::atomic<bool>* stop) {
    return read(folder, files, arrays, limits, upTo, stop);
}

Expected<JournalStory> readJournal(const JournalFolder& folder, const JournalFiles& files, JournalPlaces& places,
                                   const JournalLimits& limits, std::uint64_t upTo, const std::atomic<bool>& stop) {
    return read(folder, files, places, limits, upTo, &stop);
}

}  // namespace tessera
