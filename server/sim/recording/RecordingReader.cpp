#include "server/sim/recording/RecordingReader.h"

#include <cstring>

#include <fmt/format.h>

#include "common/scene/FieldTable.h"

namespace tessera {

RecordingReader::RecordingReader(RecordSource source, std::string name, const RecordingLimits& limits)
    : source_(std::move(source)), name_(std::move(name)), limits_(limits), arrays_(std::make_unique<BlobStore>()) {}
RecordingReader::RecordingReader(RecordingReader&&) noexcept = default;
RecordingReader::~RecordingReader() = default;

Expected<RecordingReader> RecordingReader::open(const std::string& path, const RecordingLimits& limits) {
    Expected<RecordSource> source = RecordSource::open(path);
    if (!source && source.error().code == ErrorCode::kBadInput)
        return fail(ErrorCode::kBadInput, fmt::format("{}: a recording is a regular file; this is none", path));
    if (!source) return failWith(path, source.error());
    return begin(RecordingReader(std::move(*source), path, limits));
}

Expected<RecordingReader> RecordingReader::over(Bytes bytes, const std::string& name, const RecordingLimits& limits) {
    return begin(RecordingReader(RecordSource(std::move(bytes)), name, limits));
}

Expected<RecordingReader> RecordingReader::begin(RecordingReader reader) {
    const std::uint64_t size = reader.source_.size();
    Expected<Bytes> mark = reader.source_.read(0, std::min<std::uint64_t>(size, kRecordingMark.size()));
    if (!mark) return failWith(reader.name_, mark.error());
    if (asText(*mark) != kRecordingMark)
        return fail(ErrorCode::kBadInput,
                    fmt::format("{}: it is not a recording of tessera-server --record", reader.name_));
    reader.offset_ = kRecordingMark.size();
    Expected<std::optional<Record>> first = reader.nextRecord();
    if (!first) return tl::unexpected(first.error());
    if (!*first)
        return fail(ErrorCode::kBadInput, fmt::format("{}: it ends before the recording has begun", reader.name_));
    auto* opening = std::get_if<record::Opening>(&**first);
    if (!opening)
        return fail(ErrorCode::kBadInput, fmt::format("{}: {}: it must be the opening", reader.name_, reader.where_));
    if (opening->schema != schemaHash())
        return fail(
            ErrorCode::kUnsupported,
            fmt::format("{}: {} recorded it with other scene types than this program has; replay it with that version",
                        reader.name_, opening->program));
    reader.opening_ = std::move(*opening);
    return reader;
}

Expected<std::optional<Record>> RecordingReader::nextRecord() {
    const auto failed = [&](const Error& error) { return failWith(fmt::format("{}: {}", name_, where_), error); };
    where_ = fmt::format("record {} at byte {}", number_, offset_);
    const std::uint64_t left = source_.size() - offset_;
    RecordHeader header;
    if (left < sizeof(header)) return std::optional<Record>();
    const Expected<Bytes> headerBytes = source_.read(offset_, sizeof(header));
    if (!headerBytes) return failed(headerBytes.error());
    std::memcpy(&header, headerBytes->data(), sizeof(header));
    if (!isIntact(header, number_)) return failed({ErrorCode::kBadInput, "its header is damaged"});
    where_ = fmt::format("record {} ({}) at byte {}", number_, nameOfKind(header.kind), offset_);
    if (header.bytes > limits_.maxRecordBytes)
        return failed({ErrorCode::kLimit, fmt::format("it claims {} bytes; at most {} are allowed", header.bytes,
                                                      limits_.maxRecordBytes)});
    if (header.bytes > left - sizeof(header)) return std::optional<Record>();
    Expected<Bytes> content = source_.read(offset_ + sizeof(header), header.bytes);
    if (!content) return failed(content.error());
    if (hash64(*content) != header.contentHash) return failed({ErrorCode::kBadInput, "its content is damaged"});
    Expected<Record> record = decodeRecord(header.kind, std::move(*content), *arrays_, limits_);
    if (!record) return failed(record.error());
    offset_ += sizeof(header) + header.bytes;
    ++number_;
    return std::optional<Record>(std::move(*record));
}

Expected<RecordingReader::Item> RecordingReader::next() {
    TESSERA_CHECK(stage_ != Stage::kDone, "a recording was read past its end");
    while (true) {
        Expected<std::optional<Record>> record = nextRecord();
        if (!record) {
            stage_ = Stage::kDone;
            return tl::unexpected(record.error());
        }
        if (!*record) {
            stage_ = Stage::kDone;
            return CutOff{.lastWholeBytes = offset_};
        }
        auto* array = std::get_if<record::Array>(&**record);
        if (!array) {
            Expected<Item> item = inOrder(std::move(**record));
            if (!item) stage_ = Stage::kDone;
            return item;
        }
        if (stage_ == Stage::kInFrame || arrays_->find(array->blob.id()).resident()) {
            stage_ = Stage::kDone;
            return fail(ErrorCode::kBadInput,
                        fmt::format("{}: {}: an array is out of place or there twice", name_, where_));
        }
        kept_.push_back(arrays_->add(std::move(array->blob)));
    }
}

Expected<RecordingReader::Item> RecordingReader::inOrder(Record record) {
    const auto outOfPlace = [&] {
        return fail(ErrorCode::kBadInput, fmt::format("{}: {}: it is out of place", name_, where_));
    };
    if (auto* list = std::get_if<record::StartList>(&record)) {
        if (stage_ != Stage::kScene && stage_ != Stage::kInScene) return outOfPlace();
        stage_ = Stage::kInScene;
        return std::move(*list);
    }
    if (auto* started = std::get_if<record::Started>(&record)) {
        if (stage_ != Stage::kInScene) return outOfPlace();
        stage_ = Stage::kFrames;
        return *started;
    }
    if (auto* inputs = std::get_if<record::Inputs>(&record)) {
        if (stage_ != Stage::kScene && stage_ != Stage::kFrames) return outOfPlace();
        stage_ = Stage::kInFrame;
        openFrame_ = inputs->frame;
        return std::move(*inputs);
    }
    if (auto* outcome = std::get_if<record::Outcome>(&record)) {
        if (stage_ != Stage::kInFrame || outcome->frame != openFrame_) return outOfPlace();
        stage_ = Stage::kFrames;
        ++frames_;
        return *outcome;
    }
    if (auto* closing = std::get_if<record::Closing>(&record)) {
        if (stage_ == Stage::kInFrame || closing->frames != frames_ || offset_ != source_.size()) return outOfPlace();
        stage_ = Stage::kDone;
        return *closing;
    }
    return outOfPlace();
}

}  // namespace tessera
