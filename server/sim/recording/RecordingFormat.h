/// The records of a recording, as values and as bytes.
///
/// A file begins with kRecordingMark; records follow, each a RecordHeader and its content. The header's hash covers the
/// record's number, so that a record that was changed, left out or moved is found where it stands, and a file that just
/// ends (the server was killed) is told from one that was damaged.
///
///     Opening  (Array* StartList)* Started?  (Array* Inputs Outcome)*  Closing
///
/// Arrays (blobs) stand once, before the first record that names them. Inputs are written before the frame is made:
/// where the server ended in the middle of it, the recording has what it was working on.
#pragma once

#include <array>
#include <variant>
#include <vector>

#include "common/base/Error.h"
#include "server/sim/recording/RecordBytes.h"
#include "server/sim/recording/RecordingDigest.h"

namespace tessera {

inline constexpr std::string_view kRecordingMark = "tessera record\r\n";
/// Raised whenever an older program would misread a file.
inline constexpr std::uint32_t kRecordingFormat = 4;

struct RecordingLimits {
    std::uint64_t maxFileBytes = std::uint64_t{64} << 30;  ///< a recording ends there
    /// Not yet written; beyond it the disk is too slow and the recording ends. One proposal may bring 1 GiB at once.
    std::uint64_t maxQueuedBytes = std::uint64_t{2} << 30;
    std::uint64_t maxRecordBytes = std::uint64_t{4} << 30;
    std::size_t maxEdits = 65'536;    ///< of a frame
    std::size_t maxReplies = 65'536;  ///< of a frame
};

namespace record {

/// What the recording server was, so that the replaying one is the same.
struct Opening {
    std::uint64_t schema = 0;
    std::string program;
    std::string instructionSet;
    unsigned threads = 1;
    SceneLimits limits;
    std::uint64_t collisionLimits = 0;  ///< digestOf(CollisionLimits)
};
/// A blob, before the first record that names it.
struct Array {
    Blob blob;
};
/// One of the lists handed to Simulation::load.
struct StartList {
    ChangeList list;
};
/// What Simulation::load gave.
struct Started {
    Sequence sequence;
    StateHash stateHash;
};
/// All that Simulation::step is handed.
struct Inputs {
    FrameNumber frame;
    bool first = false;
    std::vector<Edit> edits;
    std::vector<Reply> replies;
};
struct Outcome {
    FrameNumber frame;
    FrameDigest digest;
};
/// The recording ended in order.
struct Closing {
    std::uint64_t frames = 0;
};

}  // namespace record

/// The index of a Record in the variant is its kind in the file.
using Record = std::variant<record::Opening, record::Array, record::StartList, record::Started, record::Inputs,
                            record::Outcome, record::Closing>;

/// "inputs of a frame" and the like.
[[nodiscard]] std::string_view nameOfKind(std::size_t kind);

[[nodiscard]] RecordContent encodeOpening(const record::Opening& opening);
[[nodiscard]] RecordContent encodeArray(Blob blob);
[[nodiscard]] RecordContent encodeStartList(const ChangeList& list);
[[nodiscard]] RecordContent encodeStarted(const record::Started& started);
/// The list of an undo or redo is not written: nobody reads it.
[[nodiscard]] RecordContent encodeInputs(FrameNumber frame, bool first, std::span<const Edit> edits,
                                         std::span<const Reply> replies);
[[nodiscard]] RecordContent encodeOutcome(const record::Outcome& outcome);
[[nodiscard]] RecordContent encodeClosing(const record::Closing& closing);

/// Never crashes whatever the bytes are; takes no memory out of proportion to them. Arrays that lists name are looked
/// for in `arrays`; one that is not there is kBadInput.
[[nodiscard]] Expected<Record> decodeRecord(std::uint64_t kind, Bytes content, const BlobStore& arrays,
                                            const RecordingLimits& limits = {});

}  // namespace tessera
