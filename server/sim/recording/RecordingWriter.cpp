#include "server/sim/recording/RecordingWriter.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

#include <fmt/format.h>

#include "common/base/StartThread.h"
#include "common/base/Version.h"
#include "common/scene/FieldTable.h"
#include "server/collision/mesh/InstructionSet.h"

namespace tessera {

record::Opening openingOfThisServer(unsigned threads) {
    return {.schema = schemaHash(),
            .program = versionText("tessera-server"),
            .instructionSet = std::string(name(instructionSet())),
            .threads = threads,
            .limits = SceneLimits(),
            .collisionLimits = digestOf(CollisionLimits())};
}

Expected<std::unique_ptr<RecordingWriter>> RecordingWriter::create(const std::string& path,
                                                                   const record::Opening& opening, Log& log,
                                                                   const RecordingLimits& limits, MakeLane lane) {
    const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    if (file < 0)
        return fail(ErrorCode::kFailed,
                    fmt::format("{}: the recording cannot be written: {}", path, std::strerror(errno)));
    std::unique_ptr<RecordingWriter> writer(new RecordingWriter(path, file, log, limits, std::move(lane)));
    if (const int error = writeAll(file, asBytes(kRecordingMark), {}))
        return fail(ErrorCode::kFailed,
                    fmt::format("{}: the recording cannot be written: {}", path, std::strerror(error)));
    writer->writtenBytes_ = kRecordingMark.size();
    writer->write(encodeOpening(opening));
    return writer;
}

RecordingWriter::RecordingWriter(std::string path, int file, Log& log, const RecordingLimits& limits, MakeLane lane)
    : path_(std::move(path)), file_(file), log_(log), limits_(limits), makeLane_(std::move(lane)) {}

RecordingWriter::~RecordingWriter() {
    hand(encodeClosing({.frames = frames_}));
    if (lane_) lane_->finish();
    ::close(file_);
}

void RecordingWriter::startScene(std::span<const ChangeList> lists) {
    for (const ChangeList& list : lists) {
        handArraysOf(list);
        hand(encodeStartList(list));
    }
}

void RecordingWriter::started(const CommittedFrame& scene) {
    hand(encodeStarted({.sequence = scene.sent->sequence, .stateHash = scene.sent->stateHash}));
}

void RecordingWriter::frameBegins(FrameNumber frame, bool first, std::span<const Edit> edits,
                                  std::span<const Reply> replies) {
    if (ended_) return;
    try {
        if (!lane_) lane_ = makeLane_({});
    } catch (const std::system_error&) {
        return end(kNoThread);
    }
    for (const Edit& edit : edits)
        if (!isStep(edit.kind)) handArraysOf(edit.list);
    hand(encodeInputs(frame, first, edits, replies));
}

void RecordingWriter::frameDone(FrameNumber frame, const FrameResult& result) {
    if (ended_) return;
    hand(encodeOutcome({.frame = frame, .digest = digestOf(result)}));
    ++frames_;
}

void RecordingWriter::handArraysOf(const ChangeList& list) {
    for (const Blob& blob : blobsOf(list)) {
        if (!arrays_.insert(blob.id()).second) continue;
        if (!blob.resident()) return end(fmt::format("the array {} is not here", toHex(blob.id())));
        hand(encodeArray(blob));
    }
}

void RecordingWriter::hand(RecordContent content) {
    if (ended_) return;
    if (!lane_) return write(content);
    constexpr std::uint64_t kCost = 256;  // of one that waits, beside its bytes
    const std::uint64_t bytes = content.bytes().size() + kCost;
    if (queuedBytes_ + bytes > limits_.maxQueuedBytes) return end("the disk is too slow for it");
    queuedBytes_ += bytes;
    lane_->post([this, bytes, taken = std::make_shared<const RecordContent>(std::move(content))] {
        write(*taken);
        queuedBytes_ -= bytes;
    });
}

void RecordingWriter::write(const RecordContent& content) {
    if (ended_) return;
    const ByteSpan bytes = content.bytes();
    if (bytes.size() > limits_.maxRecordBytes)
        return end(fmt::format("a record of {} bytes is too large", bytes.size()));
    const RecordHeader header = headerFor(content.kind, bytes, number_);
    writtenBytes_ += sizeof(header) + bytes.size();
    if (writtenBytes_ > limits_.maxFileBytes)
        return end(fmt::format("it would be longer than {} bytes", limits_.maxFileBytes));
    if (const int error = writeAll(file_, std::as_bytes(std::span(&header, 1)), bytes))
        return end(std::strerror(error));
    ++number_;
}

void RecordingWriter::end(const std::string& why) {
    if (!ended_.exchange(true))
        log_.warning(fmt::format("{}: the recording ends here: {}; what is written can be replayed", path_, why));
}

}  // namespace tessera
