#include "server/sim/journal/JournalReader.h"

#include <algorithm>
#include <cstring>

#include <fmt/format.h>

#include "common/base/HashStreams.h"

namespace tessera {
namespace {

constexpr std::uint64_t kPiece = std::uint64_t{1} << 20;  ///< bytes in memory at once
/// Looked for behind damage. Before format 3 each costs a hash, and a hostile file has many places to look at.
constexpr std::uint64_t kMostRecordsBetween = 1 << 16, kHashesPerByte = 16, kFewHashes = 1 << 20;

}  // namespace

Expected<JournalReader> JournalReader::open(const std::string& path, BlobStore& arrays, const JournalLimits& limits) {
    Expected<RecordSource> source = RecordSource::open(path);
    if (!source) return failWith(path, source.error());
    return begin(JournalReader(std::move(*source), path, &arrays, nullptr, limits));
}

Expected<JournalReader> JournalReader::open(const std::string& path, JournalPlaces& places,
                                            const JournalLimits& limits) {
    Expected<RecordSource> source = RecordSource::open(path);
    if (!source) return failWith(path, source.error());
    return begin(JournalReader(std::move(*source), path, nullptr, &places, limits));
}

Expected<JournalReader> JournalReader::over(Bytes bytes, const std::string& name, BlobStore& arrays,
                                            const JournalLimits& limits) {
    return begin(JournalReader(RecordSource(std::move(bytes)), name, &arrays, nullptr, limits));
}

Expected<JournalReader> JournalReader::over(Bytes bytes, const std::string& name, JournalPlaces& places,
                                            const JournalLimits& limits) {
    return begin(JournalReader(RecordSource(std::move(bytes)), name, nullptr, &places, limits));
}

Expected<JournalReader> JournalReader::begin(JournalReader reader) {
    const std::uint64_t there = std::min<std::uint64_t>(reader.source_->size(), kJournalMark.size());
    const Expected<Bytes> mark = reader.source_->read(0, there);
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
        if (arrays_) kept_.push_back(arrays_->add(std::move(array->blob)));
    }
}

Expected<std::optional<JournalRecord>> JournalReader::nextRecord() {
    where_ = fmt::format("record {} at byte {}", number_, offset_);
    if (offset_ < kJournalMark.size()) return std::optional<JournalRecord>();
    RecordHeader header;
    if (bytesLeft() < sizeof(header)) return std::optional<JournalRecord>();
    const Expected<Bytes> headerBytes = source_->read(offset_, sizeof(header));
    if (!headerBytes) return tl::unexpected(headerBytes.error());
    std::memcpy(&header, headerBytes->data(), sizeof(header));
    const std::optional<std::uint64_t> kind = headers_.kindIn(header, number_);
    if (!kind) return damaged("its header is damaged");
    where_ = fmt::format("record {} ({}) at byte {}", number_, nameOfJournalKind(*kind), offset_);
    if (header.bytes > limits_.maxRecordBytes)
        return fail(ErrorCode::kLimit,
                    fmt::format("it claims {} bytes; at most {} are allowed", header.bytes, limits_.maxRecordBytes));
    if (header.bytes > bytesLeft() - sizeof(header)) {
        if (number_ == 0) return std::optional<JournalRecord>();
        return damaged("its content is cut off");
    }
    std::optional<JournalRecord> read;
    if (places_ && *kind == kindOfArrays()) {
        const Expected<bool> intact = placeArray(header);
        if (!intact) return tl::unexpected(intact.error());
        if (!*intact) return damaged("its content is damaged");
        read = journal::Array{};
    } else {
        Expected<Bytes> content = source_->read(offset_ + sizeof(header), header.bytes);
        if (!content) return tl::unexpected(content.error());
        if (hash64(*content) != header.contentHash) return damaged("its content is damaged");
        Expected<JournalRecord> record = recordOf(*kind, std::move(*content));
        if (!record) return tl::unexpected(record.error());
        read = std::move(*record);
    }
    if (number_ == 0)
        if (const auto* opening = std::get_if<journal::Opening>(&*read))
            headers_ = JournalHeaders(opening->format, header.contentHash);
    offset_ += sizeof(header) + header.bytes;
    ++number_;
    return read;
}

Expected<JournalRecord> JournalReader::recordOf(std::uint64_t kind, Bytes content) {
    if (!places_) return decodeJournal(kind, std::move(content), *arrays_, limits_);
    Expected<JournalRecord> record =
        decodeJournal(kind, std::move(content), BlobStore(), limits_, AbsentBlobs::kKeepAbsent);
    if (!record) return record;
    const auto* frame = std::get_if<journal::Frame>(&*record);
    forRangesIn(*record, content, [&](ChangeListPtr& list, ByteSpan ranges) {
        const JournalPlace place{
            source_, offset_ + sizeof(RecordHeader) + static_cast<std::uint64_t>(ranges.data() - content.data())};
        if (frame && &list == &frame->list)
            ranges_ = place;  // whoever applies it needs the bytes
        else
            list = places_->withoutRanges(*list, place);
    });
    return record;
}

Expected<bool> JournalReader::placeArray(const RecordHeader& header) {
    const JournalPlace place{source_, offset_ + sizeof(header)};
    Bytes buffer(std::min(header.bytes, kPiece));
    Hash64Stream content;
    BlobIdStream id;
    for (std::uint64_t at = 0; at < header.bytes; at += kPiece) {
        const auto piece = std::span(buffer).first(std::min(kPiece, header.bytes - at));
        if (const Expected<void> read = source_->readInto(piece, place.offset + at); !read)
            return tl::unexpected(read.error());
        content.add(piece);
        id.add(piece);
    }
    if (content.hash() != header.contentHash) return false;
    FiledArray array(place, header.bytes);
    array.contentHash = header.contentHash;
    places_->arrayIs(id.id(), std::move(array));
    return true;
}

Expected<std::optional<JournalRecord>> JournalReader::damaged(std::string_view what) const {
    // Nobody can tell which records are of this file.
    if (number_ == 0) return fail(ErrorCode::kBadInput, fmt::format("{}. Put back a copy of the file", what));
    if (offset_ >= unsyncedFrom_) return std::optional<JournalRecord>();
    const Expected<std::optional<std::uint64_t>> later = laterRecord();
    if (!later) return tl::unexpected(later.error());
    if (!*later) return std::optional<JournalRecord>();
    return fail(ErrorCode::kBadInput,
                fmt::format("{}, and later records follow it from byte {} on. Put back a copy of the file. Or, to go "
                            "on without all from the damage on: cut the file to {} bytes (truncate -s), remove the "
                            "journal's later logs, and write the file's number into `last`",
                            what, **later, offset_));
}

/// Looks at every byte: damage is rare, and worth the time, which is in proportion to the bytes.
Expected<std::optional<std::uint64_t>> JournalReader::laterRecord() const {
    RecordHeader header;
    std::uint64_t hashes = 0;
    for (std::uint64_t at = offset_ + 1; at + sizeof(header) <= source_->size(); at += kPiece) {
        const std::uint64_t bytes = std::min(kPiece + sizeof(header) - 1, source_->size() - at);
        const Expected<Bytes> piece = source_->read(at, bytes);
        if (!piece) return tl::unexpected(piece.error());  // what cannot be read is not cut off
        for (std::uint64_t i = 0; i + sizeof(header) <= piece->size() && i < kPiece; ++i) {
            std::memcpy(&header, piece->data() + i, sizeof(header));
            if (header.bytes > limits_.maxRecordBytes) continue;
            // So many records there can have been between.
            const std::uint64_t most = std::min((at + i - offset_) / sizeof(header) + 1, kMostRecordsBetween);
            if (headers_.isLater(header, number_, most, hashes)) return std::optional(at + i);
            if (hashes > kHashesPerByte * (source_->size() - offset_) + kFewHashes)
                return fail(ErrorCode::kBadInput, "it is damaged, and nobody can tell whether records follow it");
        }
    }
    return std::optional<std::uint64_t>();
}

}  // namespace tessera
