#include "server/sim/journal/JournalReader.h"

#include <algorithm>
#include <cstring>

#include <fmt/format.h>

namespace tessera {

Expected<JournalReader> JournalReader::open(const std::string& path, BlobStore& arrays, const JournalLimits& limits) {
    Expected<RecordSource> source = RecordSource::open(path);
    if (!source) return failWith(path, source.error());
    return begin(JournalReader(std::move(*source), path, arrays, limits));
}

Expected<JournalReader> JournalReader::over(Bytes bytes, const std::string& name, BlobStore& arrays,
                                            const JournalLimits& limits) {
    return begin(JournalReader(RecordSource(std::move(bytes)), name, arrays, limits));
}

Expected<JournalReader> JournalReader::begin(JournalReader reader) {
    const std::uint64_t there = std::min<std::uint64_t>(reader.source_.size(), kJournalMark.size());
    const Expected<Bytes> mark = reader.source_.read(0, there);
    if (!mark) return failWith(reader.name_, mark.error());
    if (asText(*mark) != kJournalMark.substr(0, there))
        return fail(ErrorCode::kBadInput, reader.name_ + ": it is no file of a journal (tessera-server --journal)");
    // A shorter one is torn.
    if (there == kJournalMark.size()) reader.offset_ = there;
    return reader;
}

Expected<std::optional<JournalRecord>> JournalReader::next() {
    while (true) {
        const bool first = number_ == 0;
        Expected<std::optional<JournalRecord>> record = nextRecord();
        if (!record) return failWith(where(), record.error());
        if (!*record) return record;
        if (std::holds_alternative<journal::Opening>(**record) != first)
            return fail(ErrorCode::kBadInput, where() + (first ? ": it must be the opening" : ": it is out of place"));
        auto* array = std::get_if<journal::Array>(&**record);
        if (!array) return record;
        kept_.push_back(arrays_.add(std::move(array->blob)));
    }
}

Expected<std::optional<JournalRecord>> JournalReader::nextRecord() {
    where_ = fmt::format("record {} at byte {}", number_, offset_);
    if (offset_ < kJournalMark.size()) return std::optional<JournalRecord>();
    RecordHeader header;
    if (bytesLeft() < sizeof(header)) return std::optional<JournalRecord>();
    const Expected<Bytes> headerBytes = source_.read(offset_, sizeof(header));
    if (!headerBytes) return tl::unexpected(headerBytes.error());
    std::memcpy(&header, headerBytes->data(), sizeof(header));
    if (!isIntact(header, number_)) return damaged("its header is damaged");
    where_ = fmt::format("record {} ({}) at byte {}", number_, nameOfJournalKind(header.kind), offset_);
    if (header.bytes > limits_.maxRecordBytes)
        return fail(ErrorCode::kLimit, fmt::format("it claims {} bytes; at most {} are allowed", header.bytes,
                                                   limits_.maxRecordBytes));
    if (header.bytes > bytesLeft() - sizeof(header)) return std::optional<JournalRecord>();
    Expected<Bytes> content = source_.read(offset_ + sizeof(header), header.bytes);
    if (!content) return tl::unexpected(content.error());
    if (hash64(*content) != header.contentHash) return damaged("its content is damaged");
    Expected<JournalRecord> record = decodeJournal(header.kind, std::move(*content), arrays_, limits_);
    if (!record) return tl::unexpected(record.error());
    offset_ += sizeof(header) + header.bytes;
    ++number_;
    return std::optional<JournalRecord>(std::move(*record));
}

Expected<std::optional<JournalRecord>> JournalReader::damaged(std::string_view what) const {
    if (!aRecordFollows()) return std::optional<JournalRecord>();
    return fail(ErrorCode::kBadInput, fmt::format("{}, and records follow it; to go on without all from there on, cut the "
                                                  "file to {} bytes and remove the journal's later files and `last`",
                                                  what, offset_));
}

/// Looks for the header of the next record at every byte: damage is rare, and worth the time.
bool JournalReader::aRecordFollows() const {
    constexpr std::uint64_t kPiece = std::uint64_t{1} << 20;
    RecordHeader header;
    for (std::uint64_t at = offset_ + 1; at + sizeof(header) <= source_.size(); at += kPiece) {
        const std::uint64_t bytes = std::min(kPiece + sizeof(header) - 1, source_.size() - at);
        const Expected<Bytes> piece = source_.read(at, bytes);
        if (!piece) return true;  // what cannot be read is not cut off
        for (std::uint64_t i = 0; i + sizeof(header) <= piece->size() && i < kPiece; ++i) {
            std::memcpy(&header, piece->data() + i, sizeof(header));
            if (header.bytes <= limits_.maxRecordBytes && header.kind < std::variant_size_v<JournalRecord> &&
                isIntact(header, number_ + 1))
                return true;
        }
    }
    return false;
}

}  // namespace tessera
