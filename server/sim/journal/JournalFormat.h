/// The records of a journal, as values and as bytes.
///
/// A folder holds logs and at most one snapshot, numbered: snapshot 7 is what there was when log 7 began. Each file
/// begins with kJournalMark; records follow, each behind its header (JournalHeaders.h).
///
///     log        Opening (Array* (Frame | Frames | Numbers | View | Raised))*
///     snapshot   Opening (Array* (Step | View))* Numbers Array* State
///
/// Arrays (blobs) stand once in each log that names them, before the first record that does.
///
/// Files are linked, so that a file of another journal is told from one of its own. From format 3 on an opening has one
/// part, of three u64: a random number (low, high), and the hash of the opening of the log before. Snapshot 7 and log 7
/// both follow log 6. The file `last` holds the hash of the newest log's opening.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/base/Hash.h"
#include "common/codec/ChangeCodec.h"
#include "server/sim/frame/Frame.h"
#include "server/sim/recording/RecordBytes.h"
#include "server/sim/view/ViewSource.h"

namespace tessera {

inline constexpr std::string_view kJournalMark = "tessera journal\n";
/// Raised whenever an older program would misread a file. Older ones are read: 1 had no Numbers; until 2 headers were
/// those of recordings (JournalHeaders.h), nothing told how long a log was, and files were not linked.
inline constexpr std::uint32_t kJournalFormat = 3;

struct JournalLimits {
    /// Once the logs since the snapshot are longer than this and than the snapshot, a new snapshot is made.
    std::uint64_t compactBytes = std::uint64_t{64} << 20;
    std::size_t maxLogs = 16;  ///< or more than this
    /// Not yet written. Beyond it the disk is too slow, and the journal ends. One proposal may bring 1 GiB at once.
    std::uint64_t maxQueuedBytes = std::uint64_t{5} << 30;
    std::uint64_t maxRecordBytes = std::uint64_t{16} << 30;
    std::size_t maxListChanges = std::size_t{1} << 28;
    std::size_t maxEvents = 65'536;  ///< of a frame
    /// What has been written is on the disk after this long, and the time that the disk takes: what a power cut may
    /// cost.
    std::chrono::milliseconds syncEvery{200};
    /// After a write that failed.
    std::chrono::milliseconds retryEvery{500};
    /// Whether all files of the folder are still there. Whether the one that is written to is, is looked at with each
    /// record.
    std::chrono::milliseconds lookEvery{1000};
    /// Frames without a change leave no record: so many numbers are taken at once.
    std::uint64_t framesAhead = 64;
    /// Ids and lists are sent before they are written, so they are taken long before they are given. More than may ever
    /// wait to be written, and enough for days of a journal that has ended.
    std::uint64_t idsAhead = 10'000'000'000, listsAhead = 1'000'000'000;
};

namespace journal {

/// The log before a file.
struct LogBefore {
    std::uint64_t bytes = 0;    ///< 0: there is none, or nobody knows
    std::uint64_t opening = 0;  ///< hash of its opening; 0: there is none, or the file is of a format before 3
};
/// The scene had this state before the file's first record.
struct Opening {
    std::uint64_t schema = 0;
    std::string program;
    std::uint64_t number = 0;
    Epoch epoch;                      ///< of the server that wrote it
    std::vector<std::string> scenes;  ///< what --scene said when the journal began
    Sequence sequence;
    StateHash stateHash;
    LogBefore before;
    Hash128 unique;  ///< no two files have the same; JournalFile::create draws it
    std::uint32_t format = kJournalFormat;
};
/// A blob, before the first record that names it.
struct Array {
    Blob blob;
};
/// What a frame changed.
struct Frame {
    bool start = false;  ///< the scene before the first frame; `frame` says nothing
    FrameNumber frame;
    Sequence sequence;
    StateHash stateHash;
    ChangeListPtr list;  ///< null: only the history changed
    std::vector<HistoryEvent> history;
    std::optional<std::vector<ObjectId>> display;  ///< ContactDisplay::ids, where they have changed
    CommittedListPtr sent =
        nullptr;  ///< of one that is to be written: has the bytes of `list`. Null: they are made anew
};
/// Frames before this one may have been shown.
struct Frames {
    FrameNumber next;
};
/// What others may have seen of numbers, though it was not written.
struct Numbers {
    std::uint64_t nextId = 0;  ///< ids before it may have been given; those of the scene have in any case
    Sequence lastList;         ///< lists up to it may have been sent; those that are written have in any case
    Sequence behind;           ///< the next list follows this one
};
struct View {
    ViewState state;
};
/// The server that writes has this epoch from here on: a host had seen a later one than it was given.
struct Raised {
    Epoch epoch;
};
/// One of the history, in the order of EditHistory::kept.
struct Step {
    EditHistory::Kept kept;
};
/// The rest of a snapshot, and its end.
struct State {
    bool begun = false;
    FrameNumber nextFrame;
    Sequence sequence;
    StateHash stateHash;
    ChangeListPtr list;
    std::vector<ObjectId> display;
};

}  // namespace journal

/// The index of a JournalRecord in the variant is its kind in the file.
using JournalRecord = std::variant<journal::Opening, journal::Array, journal::Frame, journal::Frames, journal::View,
                                   journal::Step, journal::State, journal::Raised, journal::Numbers>;

[[nodiscard]] std::string_view nameOfJournalKind(std::uint64_t kind);

[[nodiscard]] RecordContent encodeJournal(const JournalRecord& record);

/// Never crashes whatever the bytes are; takes no memory out of proportion to them. Arrays that lists name are looked
/// for in `arrays`; one that is not there is kBadInput, or absent. The content of an array is taken, any other stays
/// where it is.
[[nodiscard]] Expected<JournalRecord> decodeJournal(std::uint64_t kind, Bytes&& content, const BlobStore& arrays,
                                                    const JournalLimits& limits = {},
                                                    AbsentBlobs absent = AbsentBlobs::kRefuse);

[[nodiscard]] std::uint64_t kindOfArrays();
/// For each list of the record that edits ranges: the list, and where in `content`, which the record was decoded from,
/// the bytes of its ranges lie, one behind the other.
void forRangesIn(JournalRecord& record, ByteSpan content,
                 const std::function<void(ChangeListPtr& list, ByteSpan rangeBytes)>& visit);

}  // namespace tessera
