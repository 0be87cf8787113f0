/// Reads one file of a journal, record by record.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "server/sim/journal/JournalFormat.h"
#include "server/sim/journal/JournalHeaders.h"
#include "server/sim/journal/JournalPlaces.h"

namespace tessera {

/// A file or bytes in memory. Memory taken at any time is in proportion to the bytes there are, not to what they claim.
///
/// A file that a killed server wrote ends in the middle of a record: what is damaged, and has no later record behind it
/// at any byte, is *torn*. Damage with one behind it is an error, and so is a damaged opening. Errors name the file,
/// the record and where it begins: "wall/log-0000000001: record 17 (frame) at byte 4711: …". kBadInput, kLimit,
/// kUnsupported, kNotFound.
class JournalReader {
public:
    /// Reads nothing yet. Arrays are found in `arrays` from then on, for as long as the reader or somebody else holds
    /// them.
    [[nodiscard]] static Expected<JournalReader> open(const std::string& path, BlobStore& arrays,
                                                      const JournalLimits& limits = {});
    /// Arrays stay in the file: `places` knows where from then on, and lists name them as absent. So do the ranges of
    /// the history's lists.
    [[nodiscard]] static Expected<JournalReader> open(const std::string& path, JournalPlaces& places,
                                                      const JournalLimits& limits = {});
    [[nodiscard]] static Expected<JournalReader> over(Bytes bytes, const std::string& name, BlobStore& arrays,
                                                      const JournalLimits& limits = {});
    [[nodiscard]] static Expected<JournalReader> over(Bytes bytes, const std::string& name, JournalPlaces& places,
                                                      const JournalLimits& limits = {});

    /// From that byte on nothing was on the disk for certain when the power was cut: records behind damage say nothing.
    void mayLackRecordsFrom(std::uint64_t bytes) { unsyncedFrom_ = bytes; }

    /// Never an array: those are kept for the records behind them. Nothing where the file ends or is torn; then no more
    /// may be asked for, nor after an error. The first record is the opening, and no other is one.
    [[nodiscard]] Expected<std::optional<JournalRecord>> next();

    /// Where the bytes of the ranges lie, one behind the other, that the list of the frame last read edits. Of a reader
    /// with places.
    [[nodiscard]] const JournalPlace& ranges() const { return ranges_; }

    /// Returns the hash of the opening's content, and 0 before it is read.
    [[nodiscard]] std::uint64_t openingHash() const { return headers_.openingHash(); }
    /// Bytes of the records read so far: where a torn one begins.
    [[nodiscard]] std::uint64_t wholeBytes() const { return offset_; }
    /// Bytes behind them.
    [[nodiscard]] std::uint64_t bytesLeft() const { return source_->size() - offset_; }
    [[nodiscard]] const std::string& name() const { return name_; }
    /// "wall/log-0000000001: record 17 (frame) at byte 4711", the one last read.
    [[nodiscard]] std::string where() const { return name_ + ": " + where_; }

private:
    JournalReader(RecordSource source, std::string name, BlobStore* arrays, JournalPlaces* places,
                  const JournalLimits& limits)
        : source_(std::make_shared<const RecordSource>(std::move(source))),
          name_(std::move(name)),
          arrays_(arrays),
          places_(places),
          limits_(limits) {}
    [[nodiscard]] static Expected<JournalReader> begin(JournalReader reader);
    [[nodiscard]] Expected<std::optional<JournalRecord>> nextRecord();
    [[nodiscard]] Expected<JournalRecord> recordOf(std::uint64_t kind, Bytes content);
    /// False: its content is not what its header says.
    [[nodiscard]] Expected<bool> placeArray(const RecordHeader& header);
    /// Nothing where the damaged record is torn, else `what` as an error.
    [[nodiscard]] Expected<std::optional<JournalRecord>> damaged(std::string_view what) const;
    /// Where a later record begins; nothing: there is none.
    [[nodiscard]] Expected<std::optional<std::uint64_t>> laterRecord() const;

    std::shared_ptr<const RecordSource> source_;
    std::string name_;
    BlobStore* arrays_;      ///< null: there are places
    JournalPlaces* places_;  ///< null: there are arrays
    JournalLimits limits_;
    std::vector<Blob> kept_;  ///< any later list may name any array again
    JournalPlace ranges_;
    JournalHeaders headers_;
    std::uint64_t offset_ = 0, number_ = 0;
    std::uint64_t unsyncedFrom_ = ~std::uint64_t{0};
    std::string where_ = "its beginning";
};

}  // namespace tessera
