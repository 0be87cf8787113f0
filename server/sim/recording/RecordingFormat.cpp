#include "server/sim/recording/RecordingFormat.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include <fmt/format.h>

#include "common/codec/ChangeCodec.h"
#include "common/codec/Parts.h"
#include "proto/recording.pb.h"

namespace tessera {
namespace {

namespace wire = proto::recording;

constexpr std::array<std::string_view, std::variant_size_v<Record>> kKindNames{
    "opening", "array", "start list", "started", "inputs of a frame", "outcome of a frame", "closing"};
constexpr std::size_t kMaxHeadBytes = 4096;

template <typename T, std::size_t I = 0>
constexpr std::uint64_t kindOf() {
    if constexpr (std::is_same_v<std::variant_alternative_t<I, Record>, T>)
        return I;
    else
        return kindOf<T, I + 1>();
}

struct EditRecord {
    static constexpr std::uint64_t kUndoable = 1, kOfFile = 2;
    std::uint64_t ticket = 0, kind = 0, flags = 0, gestureBy = 0, gesture = 0, objects = 0;
};
/// question, decision, translation, rotation w x y z, scale: numbers as their bits.
using ReplyRecord = std::array<std::uint64_t, 12>;
/// Of an edit that moves a node: which one, counted from 0; numbers as those of a reply.
struct MoveRecord {
    static constexpr std::uint64_t kRelative = 1, kTranslation = 2, kRotation = 4, kScale = 8, kAll = 15;
    std::uint64_t edit = 0, node = 0, flags = 0;
    std::array<std::uint64_t, 10> pose{};
};

template <typename T>
RecordContent headOnly(const google::protobuf::MessageLite& head) {
    return {.kind = kindOf<T>(), .content = joinParts(head, {})};
}

tl::unexpected<Error> malformed(std::string_view what) {
    return fail(ErrorCode::kBadInput, std::string(what));
}

/// The head of a record that has exactly so many parts.
template <typename Head>
Expected<Head> headOf(ByteSpan bytes) {
    const Expected<SplitParts> split = splitParts(bytes, kMaxHeadBytes, 0);
    if (!split) return tl::unexpected(split.error());
    Head head;
    if (!head.ParseFromArray(split->head.data(), static_cast<int>(split->head.size())))
        return malformed("its head cannot be read");
    return head;
}

std::array<std::uint64_t, 10> pack(const Pose& pose) {
    const std::array<double, 10> numbers{
        pose.translation.x(), pose.translation.y(), pose.translation.z(), pose.rotation.w(), pose.rotation.x(),
        pose.rotation.y(),    pose.rotation.z(),    pose.scale.x(),       pose.scale.y(),    pose.scale.z()};
    std::array<std::uint64_t, 10> bits{};
    std::ranges::transform(numbers, bits.begin(), [](double v) { return std::bit_cast<std::uint64_t>(v); });
    return bits;
}

Pose poseFrom(std::span<const std::uint64_t> bits) {
    const auto number = [&](std::size_t i) { return std::bit_cast<double>(bits[i]); };
    return {.translation = Vec3d(number(0), number(1), number(2)),
            .rotation = Quatd(number(3), number(4), number(5), number(6)),
            .scale = Vec3d(number(7), number(8), number(9))};
}

ReplyRecord pack(const Reply& reply) {
    const auto& [question, decision, pose] = reply;
    ReplyRecord record{question, static_cast<std::uint64_t>(decision)};
    std::ranges::copy(pack(pose), record.begin() + 2);
    return record;
}

Expected<Reply> unpack(const ReplyRecord& record) {
    if (record[1] > static_cast<std::uint64_t>(Reply::Decision::kMove))
        return malformed(fmt::format("decision {} is none", record[1]));
    return Reply{.question = record[0],
                 .decision = static_cast<Reply::Decision>(record[1]),
                 .pose = poseFrom(std::span(record).subspan(2))};
}

MoveRecord pack(std::size_t edit, ObjectId node, const NodeMove& move) {
    const std::uint64_t flags = (move.relative ? MoveRecord::kRelative : 0) |
                                (move.translation ? MoveRecord::kTranslation : 0) |
                                (move.rotation ? MoveRecord::kRotation : 0) | (move.scale ? MoveRecord::kScale : 0);
    const Pose pose;
    return {.edit = edit,
            .node = node.value,
            .flags = flags,
            .pose = pack(Pose{.translation = move.translation.value_or(pose.translation),
                              .rotation = move.rotation.value_or(pose.rotation),
                              .scale = move.scale.value_or(pose.scale)})};
}

NodeMove unpack(const MoveRecord& record) {
    const Pose pose = poseFrom(record.pose);
    NodeMove move{.relative = (record.flags & MoveRecord::kRelative) != 0};
    if ((record.flags & MoveRecord::kTranslation) != 0) move.translation = pose.translation;
    if ((record.flags & MoveRecord::kRotation) != 0) move.rotation = pose.rotation;
    if ((record.flags & MoveRecord::kScale) != 0) move.scale = pose.scale;
    return move;
}

Expected<ChangeList> listFrom(ByteSpan bytes, const BlobStore& arrays) {
    return decodeChangeList(bytes, arrays, AbsentBlobs::kRefuse);
}

Expected<Record> openingFrom(ByteSpan bytes) {
    const Expected<wire::Opening> head = headOf<wire::Opening>(bytes);
    if (!head) return tl::unexpected(head.error());
    if (head->format() != kRecordingFormat)
        return fail(ErrorCode::kUnsupported,
                    fmt::format("it is of format {}; this program reads format {}", head->format(), kRecordingFormat));
    // They are printed, and a terminal obeys what is not text.
    for (const std::string* text : {&head->program(), &head->instruction_set()})
        if (text->size() > 256 || !std::ranges::all_of(*text, [](char c) { return c >= ' ' && c <= '~'; }))
            return malformed("it names a program in characters that are not printable");
    // What nobody's scene needs would let a file take all memory there is.
    const SceneLimits most;
    if (head->max_objects() > most.maxObjects || head->max_children() > most.maxChildren ||
        head->max_depth() > most.maxDepth || head->max_text_bytes() > most.maxTextBytes)
        return fail(ErrorCode::kLimit, "its scene limits are higher than this program's");
    return record::Opening{.schema = head->schema(),
                           .program = head->program(),
                           .instructionSet = head->instruction_set(),
                           .threads = head->threads(),
                           .limits = {.maxObjects = head->max_objects(),
                                      .maxChildren = head->max_children(),
                                      .maxDepth = head->max_depth(),
                                      .maxTextBytes = head->max_text_bytes()},
                           .collisionLimits = head->collision_limits()};
}

Expected<Record> inputsFrom(ByteSpan bytes, const BlobStore& arrays, const RecordingLimits& limits) {
    constexpr std::size_t kFixedParts = 3;
    const Expected<SplitParts> split = splitParts(bytes, kMaxHeadBytes, kFixedParts + limits.maxEdits);
    if (!split) return tl::unexpected(split.error());
    wire::Inputs head;
    if (!head.ParseFromArray(split->head.data(), static_cast<int>(split->head.size())))
        return malformed("its head cannot be read");
    if (split->parts.size() < kFixedParts) return malformed("edits, replies and moves are missing");
    const Expected<std::vector<EditRecord>> edits = recordsFrom<EditRecord>(split->parts[0], limits.maxEdits);
    if (!edits) return failWith("edits", edits.error());
    const Expected<std::vector<ReplyRecord>> replies = recordsFrom<ReplyRecord>(split->parts[1], limits.maxReplies);
    if (!replies) return failWith("replies", replies.error());
    const Expected<std::vector<MoveRecord>> moves = recordsFrom<MoveRecord>(split->parts[2], limits.maxEdits);
    if (!moves) return failWith("moves", moves.error());
    if (split->parts.size() != kFixedParts + edits->size())
        return malformed(fmt::format("{} edits with {} lists", edits->size(), split->parts.size() - kFixedParts));

    record::Inputs inputs{.frame = FrameNumber(head.frame()), .first = head.first(), .edits = {}, .replies = {}};
    for (std::size_t i = 0; i < edits->size(); ++i) {
        const EditRecord& edit = (*edits)[i];
        if ((edit.flags & ~(EditRecord::kUndoable | EditRecord::kOfFile)) != 0)
            return malformed("an edit has flags that are none");
        if (edit.kind > static_cast<std::uint64_t>(Edit::Kind::kLastPart))
            return malformed("an edit is of a kind that is none");
        Expected<ChangeList> list = listFrom(split->parts[kFixedParts + i], arrays);
        if (!list) return failWith(fmt::format("edit {}", i + 1), list.error());
        inputs.edits.push_back({.ticket = edit.ticket,
                                .list = std::move(*list),
                                .kind = static_cast<Edit::Kind>(edit.kind),
                                .undoable = (edit.flags & EditRecord::kUndoable) != 0,
                                .gesture = {edit.gestureBy, edit.gesture},
                                .objects = edit.objects,
                                .ofFile = (edit.flags & EditRecord::kOfFile) != 0});
    }
    for (const MoveRecord& move : *moves) {
        if (move.edit >= inputs.edits.size() || (move.flags & ~MoveRecord::kAll) != 0)
            return malformed("a move is of no edit, or of a kind that is none");
        inputs.edits[move.edit].move = unpack(move);
        inputs.edits[move.edit].node = ObjectId(move.node);
    }
    for (const ReplyRecord& packed : *replies) {
        const Expected<Reply> reply = unpack(packed);
        if (!reply) return failWith("reply", reply.error());
        inputs.replies.push_back(*reply);
    }
    return inputs;
}

Expected<Record> outcomeFrom(ByteSpan bytes) {
    const Expected<wire::Outcome> head = headOf<wire::Outcome>(bytes);
    if (!head) return tl::unexpected(head.error());
    if (head->counts_size() != kDigestParts || head->hashes_size() != kDigestParts ||
        head->counters_size() != kDigestCounters)
        return malformed("it has another number of parts than this format");
    record::Outcome outcome{
        .frame = FrameNumber(head->frame()),
        .digest = {.sequence = Sequence(head->sequence()), .stateHash = StateHash(head->state_hash())}};
    for (int i = 0; i < static_cast<int>(kDigestParts); ++i)
        outcome.digest.parts[static_cast<std::size_t>(i)] = {.count = head->counts(i), .hash = head->hashes(i)};
    std::ranges::copy(head->counters(), outcome.digest.counters.begin());
    return outcome;
}

}  // namespace

std::string_view nameOfKind(std::size_t kind) {
    return kind < kKindNames.size() ? kKindNames[kind] : "unknown";
}

RecordContent encodeOpening(const record::Opening& opening) {
    wire::Opening head;
    head.set_format(kRecordingFormat);
    head.set_schema(opening.schema);
    head.set_program(opening.program);
    head.set_instruction_set(opening.instructionSet);
    head.set_threads(opening.threads);
    head.set_max_objects(opening.limits.maxObjects);
    head.set_max_children(opening.limits.maxChildren);
    head.set_max_depth(opening.limits.maxDepth);
    head.set_max_text_bytes(opening.limits.maxTextBytes);
    head.set_collision_limits(opening.collisionLimits);
    return headOnly<record::Opening>(head);
}

RecordContent encodeArray(Blob blob) {
    return {.kind = kindOf<record::Array>(), .content = std::move(blob)};
}

RecordContent encodeStartList(const ChangeList& list) {
    return {.kind = kindOf<record::StartList>(), .content = encodeChangeList(list)};
}

RecordContent encodeStarted(const record::Started& started) {
    wire::Started head;
    head.set_sequence(started.sequence.value);
    head.set_state_hash(started.stateHash.value);
    return headOnly<record::Started>(head);
}

RecordContent encodeInputs(FrameNumber frame, bool first, std::span<const Edit> edits, std::span<const Reply> replies) {
    wire::Inputs head;
    head.set_frame(frame.value);
    head.set_first(first);
    std::vector<EditRecord> editRecords;
    std::vector<MoveRecord> moves;
    std::vector<Bytes> lists;
    for (const Edit& edit : edits) {
        const auto& [ticket, list, kind, undoable, gesture, move, node, objects, ofFile] = edit;
        if (move) moves.push_back(pack(editRecords.size(), node, *move));
        editRecords.push_back({.ticket = ticket,
                               .kind = static_cast<std::uint64_t>(kind),
                               .flags = (undoable ? EditRecord::kUndoable : 0) | (ofFile ? EditRecord::kOfFile : 0),
                               .gestureBy = gesture.by,
                               .gesture = gesture.id,
                               .objects = objects});
        lists.push_back(encodeChangeList(isStep(kind) ? ChangeList() : list));
    }
    std::vector<ReplyRecord> replyRecords;
    for (const Reply& reply : replies) replyRecords.push_back(pack(reply));
    std::vector<ByteSpan> parts{recordBytes(editRecords), recordBytes(replyRecords), recordBytes(moves)};
    parts.insert(parts.end(), lists.begin(), lists.end());
    return {.kind = kindOf<record::Inputs>(), .content = joinParts(head, parts)};
}

RecordContent encodeOutcome(const record::Outcome& outcome) {
    wire::Outcome head;
    head.set_frame(outcome.frame.value);
    head.set_sequence(outcome.digest.sequence.value);
    head.set_state_hash(outcome.digest.stateHash.value);
    for (const FrameDigest::Part& part : outcome.digest.parts) {
        head.add_counts(part.count);
        head.add_hashes(part.hash);
    }
    for (const std::uint64_t counter : outcome.digest.counters) head.add_counters(counter);
    return headOnly<record::Outcome>(head);
}

RecordContent encodeClosing(const record::Closing& closing) {
    wire::Closing head;
    head.set_frames(closing.frames);
    return headOnly<record::Closing>(head);
}

Expected<Record> decodeRecord(std::uint64_t kind, Bytes content, const BlobStore& arrays,
                              const RecordingLimits& limits) {
    switch (kind) {
        case kindOf<record::Opening>():
            return openingFrom(content);
        case kindOf<record::Array>():
            return record::Array{Blob(std::move(content))};
        case kindOf<record::StartList>(): {
            Expected<ChangeList> list = listFrom(content, arrays);
            if (!list) return tl::unexpected(list.error());
            return record::StartList{std::move(*list)};
        }
        case kindOf<record::Started>(): {
            const Expected<wire::Started> head = headOf<wire::Started>(content);
            if (!head) return tl::unexpected(head.error());
            return record::Started{.sequence = Sequence(head->sequence()), .stateHash = StateHash(head->state_hash())};
        }
        case kindOf<record::Inputs>():
            return inputsFrom(content, arrays, limits);
        case kindOf<record::Outcome>():
            return outcomeFrom(content);
        case kindOf<record::Closing>(): {
            const Expected<wire::Closing> head = headOf<wire::Closing>(content);
            if (!head) return tl::unexpected(head.error());
            return record::Closing{.frames = head->frames()};
        }
        default:
            return malformed(fmt::format("kind {} is none", kind));
    }
}

}  // namespace tessera
