/// Reads a recording, record by record.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "server/sim/recording/RecordingFormat.h"

namespace tessera {

/// A file or bytes in memory. The file must be a regular one; what is appended while it is read is not seen. Memory
/// taken at any time is in proportion to the bytes there are, not to what they claim.
///
/// Errors name the file, the record and where it begins: "hall.rec: record 17 (outcome of a frame) at byte 4711: …".
/// kBadInput, kLimit, kUnsupported, kNotFound.
class RecordingReader {
public:
    /// Reads up to and with the opening. Refuses other formats and scenes of another schema.
    [[nodiscard]] static Expected<RecordingReader> open(const std::string& path, const RecordingLimits& limits = {});
    [[nodiscard]] static Expected<RecordingReader> over(Bytes bytes, const std::string& name,
                                                        const RecordingLimits& limits = {});
    RecordingReader(RecordingReader&&) noexcept;
    RecordingReader& operator=(RecordingReader&&) = delete;
    ~RecordingReader();

    [[nodiscard]] const record::Opening& opening() const { return opening_; }

    /// The file ends before the recording does: in the middle of a record, or behind one that is not the closing.
    struct CutOff {
        std::uint64_t lastWholeBytes = 0;
    };
    using Item =
        std::variant<record::StartList, record::Started, record::Inputs, record::Outcome, record::Closing, CutOff>;
    /// In an order that makes sense (RecordingFormat.h): an outcome follows the inputs of the same frame. After
    /// Closing, CutOff or an error no more may be asked for.
    [[nodiscard]] Expected<Item> next();

private:
    RecordingReader(RecordSource source, std::string name, const RecordingLimits& limits);
    [[nodiscard]] static Expected<RecordingReader> begin(RecordingReader reader);
    /// Nothing where the file ends.
    [[nodiscard]] Expected<std::optional<Record>> nextRecord();
    [[nodiscard]] Expected<Item> inOrder(Record record);

    RecordSource source_;
    std::string name_;
    RecordingLimits limits_;
    record::Opening opening_;
    std::unique_ptr<BlobStore> arrays_;
    std::vector<Blob> kept_;  ///< any later list may name any array again
    std::uint64_t offset_ = 0, number_ = 0;
    std::uint64_t frames_ = 0;
    FrameNumber openFrame_;
    enum class Stage : std::uint8_t { kScene, kInScene, kFrames, kInFrame, kDone };
    Stage stage_ = Stage::kScene;
    std::string where_;  ///< the record last read
};

}  // namespace tessera
