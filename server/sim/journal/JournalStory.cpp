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
    journal::LogBefore before;                   ///< of a log: what it has to follow
    std::string nameBefore;                      ///< the log before it, or the snapshot
    std::string nameOfLast, cure;                ///< the file `last`; how to go on without it
    const JournalEnd::Extent* extent = nullptr;  ///< `last` names this log; null: another one, or nothing more is known
};

/// Whether a record of this kind stands in such a file.
bool belongsThere(const JournalRecord& record, bool inSnapshot) {
    if (std::holds_alternative<journal::Opening>(record) || std::holds_alternative<journal::View>(record) ||
        std::holds_alternative<journal::Numbers>(record))
        return true;
    return inSnapshot ==
           (std::holds_alternative<journal::Step>(record) || std::holds_alternative<journal::State>(record));
}

/// Refuses a log of another journal, and one behind or before which such a file stands.
Expected<void> fits(const journal::Opening& opening, const JournalReader& reader, const FileInOrder& file) {
    if (file.isSnapshot) return {};
    constexpr std::string_view kOneOfThem =
        "one of the two files is of another journal, or of another time. Put back a copy of it";
    if (opening.format >= 3 && opening.before.opening != file.before.opening && file.nameBefore.empty())
        return fail(ErrorCode::kBadInput,
                    reader.where() + ": it was begun behind another log, and it is the first. Put back a copy of it");
    if (opening.format >= 3 && opening.before.opening != file.before.opening)
        return fail(ErrorCode::kBadInput,
                    fmt::format("{}: it was not begun behind {}: {}", reader.where(), file.nameBefore, kOneOfThem));
    if (file.extent && file.extent->opening != reader.openingHash())
        return fail(ErrorCode::kBadInput,
                    fmt::format("{}: {} names another log of this number: {}; or, to go on with the logs that are "
                                "there, {}",
                                reader.where(), file.nameOfLast, kOneOfThem, file.cure));
    if (opening.before.bytes == 0 || file.before.bytes == 0 || opening.before.bytes == file.before.bytes) return {};
    return fail(ErrorCode::kBadInput,
                fmt::format("{}: it has {} bytes; when the next log was begun, it had {}. Put back a copy of it",
                            file.nameBefore, file.before.bytes, opening.before.bytes));
}

/// Whether a new log has this record before `last` names it.
bool isOfItsBeginning(const JournalRecord& record) {
    return std::holds_alternative<journal::Opening>(record) || std::holds_alternative<journal::Frames>(record) ||
           std::holds_alternative<journal::Numbers>(record);
}

/// Reads a file to its end. The reader is left there. `places`: the reader's, or null. Returns whether there is more
/// than the beginning of a log.
Expected<bool> takeAll(JournalReader& reader, const FileInOrder& file, JournalState& state, JournalPlaces* places,
                       const std::atomic<bool>* stop) {
    bool ended = false, more = false;
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
            if (const Expected<void> fit = fits(*opening, reader, file); !fit) return tl::unexpected(fit.error());
        more |= !isOfItsBeginning(**record);
        const auto* frame = places ? std::get_if<journal::Frame>(&**record) : nullptr;
        if (frame && frame->list)
            if (const Expected<void> known = places->comes(*frame->list, state.scene, reader.ranges()); !known)
                return failWith(reader.where(), known.error());
        if (const Expected<void> taken = state.take(std::move(**record)); !taken)
            return failWith(reader.where(), taken.error());
        if (places) places->sweep(state.history);
    }
    if (!file.isSnapshot || (ended && reader.bytesLeft() == 0)) return more;
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
        if (const Expected<bool> taken = takeAll(*reader, {.isSnapshot = true}, story.state, places, stop); !taken)
            return tl::unexpected(taken.error());
        story.snapshotBytes = reader->wholeBytes();
        if (story.state.number != *files.snapshot)
            return fail(ErrorCode::kBadInput, reader->name() + ": it is the snapshot of another log");
    }
    FileInOrder file{.nameOfLast = folder.last().path()};
    if (files.snapshot) {
        story.before.opening = story.state.before.opening;
        file.nameBefore = folder.snapshotPath(*files.snapshot);
    }
    for (const std::uint64_t number : files.logs) {
        if (upTo && number >= *upTo) break;
        Expected<JournalReader> reader = JournalReader::open(folder.logPath(number), kept, limits);
        if (!reader) return tl::unexpected(reader.error());
        const bool isLast = number == files.lastLog();
        file.before = story.before;
        file.extent = files.isNamed(number) && files.end->extent ? &*files.end->extent : nullptr;
        file.cure = folder.last().cure(files.lastLog());
        const JournalEnd::Extent* const extent = isLast ? file.extent : nullptr;
        const bool powerWasCut = extent && !extent->isOf(folder.disk().calls().boot());
        if (powerWasCut) reader->mayLackRecordsFrom(extent->synced);
        const Expected<bool> more = takeAll(*reader, file, story.state, places, stop);
        if (!more) return tl::unexpected(more.error());
        story.logBytes += reader->wholeBytes();
        story.wholeBytes = reader->wholeBytes();
        story.tornBytes = reader->bytesLeft();
        story.hollow = story.wholeBytes <= kJournalMark.size();
        if (!story.hollow && story.state.number != number)
            return fail(ErrorCode::kBadInput, fmt::format("{}: it is log {}", reader->name(), story.state.number));
        if (!story.hollow) story.before = {.bytes = story.wholeBytes, .opening = reader->openingHash()};
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
            // Nobody builds on a log before it is named: neither edits nor a snapshot.
            if (files.end && files.end->extent && !extent && (*more || files.snapshot == number))
                return fail(ErrorCode::kBadInput,
                            fmt::format("{}: it names log {} as the newest, and {} has been gone on with. Put back "
                                        "the `last` of this journal; or, to go on with the logs that are there, {}",
                                        folder.last().path(), files.end->log, reader->name(), file.cure));
            story.afterPowerCut = powerWasCut && story.wholeBytes < extent->written;
            break;
        }
        if (Expected<void> whole = wholeOrRefused(*reader); !whole || story.hollow)
            return whole ? fail(ErrorCode::kBadInput, reader->name() + ": nothing is in it, and other logs follow it")
                         : tl::unexpected(whole.error());
        file.nameBefore = reader->name();
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
