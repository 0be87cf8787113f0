/// Reads one file of a journal, record by record.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "server/sim/journal/JournalFormat.h"

namespace tessera {

/// A file or bytes in memory. Memory taken at any time is in proportion to the bytes there are, not to what they claim.
///
/// A file that a killed server wrote ends in the middle of a record: what is damaged, and has no record behind it, is *torn*. Damage
/// with a record behind it is an error. Errors name the file, the record and where it begins:
/// "wall/log-0000000001: record 17 (frame) at byte 4711: …". kBadInput, kLimit, kUnsupported, kNotFound.
class JournalReader {
public:
    /// Reads nothing yet. Arrays are found in `arrays` from then on, for as long as the reader or somebody else holds them.
    [[nodiscard]] static Expected<JournalReader> open(const std::string& path, BlobStore& arrays,
                                                      const JournalLimits& limits = {});
    [[nodiscard]] static Expected<JournalReader> over(Bytes bytes, const std::string& name, BlobStore& arrays,
                                                      const JournalLimits& limits = {});

    /// Never an array: those are kept for the records behind them. Nothing where the file ends or is torn; then no more may be asked
    /// for, nor after an error. The first record is the opening, and no other is one.
    [[nodiscard]] Expected<std::optional<JournalRecord>> next();

    /// Bytes of the records read so far: where a torn one begins.
    [[nodiscard]] std::uint64_t wholeBytes() const { return offset_; }
    /// Bytes behind them.
    [[nodiscard]] std::uint64_t bytesLeft() const { return source_.size() - offset_; }
    [[nodiscard]] const std::string& name() const { return name_; }
    /// "wall/log-0000000001: record 17 (frame) at byte 4711", the one last read.
    [[nodiscard]] std::string where() const { return name_ + ": " + where_; }

private:
    JournalReader(RecordSource source, std::string name, BlobStore& arrays, const JournalLimits& limits)
        : source_(std::move(source)), name_(std::move(name)), arrays_(arrays), limits_(limits) {}
    [[nodiscard]] static Expected<JournalReader> begin(JournalReader reader);
    [[nodiscard]] Expected<std::optional<JournalRecord>> nextRecord();
    /// Nothing where no record follows the damaged one, else `what` as an error.
    [[nodiscard]] Expected<std::optional<JournalRecord>> damaged(std::string_view what) const;
    [[nodiscard]] bool aRecordFollows() const;

    RecordSource source_;
    std::string name_;
    BlobStore& arrays_;
    JournalLimits limits_;
    std::vector<Blob> kept_;  ///< any later list may name any array again
    std::uint64_t offset_ = 0, number_ = 0;
    std::string where_ = "its beginning";
};

}  // namespace tessera
