#include "server/sim/journal/JournalFormat.h"

#include <algorithm>
#include <array>
#include <limits>

#include <fmt/format.h>

#include "common/codec/FrameCodec.h"
#include "common/codec/Parts.h"
#include "common/scene/ColumnShapes.h"
#include "proto/journal.pb.h"

namespace tessera {
namespace {

namespace wire = proto::journal;

constexpr std::array<std::string_view, std::variant_size_v<JournalRecord>> kKindNames{
    "opening", "array",        "frame",  "numbers of frames", "view", "step of the history",
    "state",   "higher epoch", "numbers"};
constexpr std::size_t kMaxHeadBytes = std::size_t{1} << 20;
constexpr std::size_t kMaxDisplayIds = 65'536;
constexpr std::size_t kMaxStepLists = 65'536;
constexpr std::size_t kFixedParts = 3;  ///< of a frame: its list, its display, its events; the events' lists follow

constexpr std::uint32_t kLinkedFormat = 3;  ///< the first whose openings have a link

struct LinkRecord {
    std::uint64_t uniqueLow = 0, uniqueHigh = 0, openingBefore = 0;
};
struct EventRecord {
    std::uint64_t kind = 0, gestureBy = 0, gesture = 0, madeFirst = 0, madeCount = 0;
};

template <typename T, std::size_t I = 0>
constexpr std::uint64_t kindOf() {
    if constexpr (std::is_same_v<std::variant_alternative_t<I, JournalRecord>, T>)
        return I;
    else
        return kindOf<T, I + 1>();
}

template <typename T>
RecordContent contentOf(const google::protobuf::MessageLite& head, std::span<const ByteSpan> parts = {}) {
    return {.kind = kindOf<T>(), .content = joinParts(head, parts)};
}

tl::unexpected<Error> malformed(std::string_view what) {
    return fail(ErrorCode::kBadInput, std::string(what));
}

/// A record's head, and parts of a number that may be.
template <typename Head>
struct Taken {
    Head head;
    std::vector<ByteSpan> parts;
};
template <typename Head>
Expected<Taken<Head>> take(ByteSpan bytes, std::size_t fewest, std::size_t most) {
    Expected<SplitParts> split = splitParts(bytes, kMaxHeadBytes, most);
    if (!split) return tl::unexpected(split.error());
    Taken<Head> taken{.head = {}, .parts = std::move(split->parts)};
    if (!taken.head.ParseFromArray(split->head.data(), static_cast<int>(split->head.size())))
        return malformed("its head cannot be read");
    if (taken.parts.size() < fewest) return malformed("parts of it are missing");
    return taken;
}

/// How lists are read.
struct Reading {
    const BlobStore& arrays;
    const JournalLimits& limits;
    AbsentBlobs absent;
};

Expected<ChangeListPtr> listFrom(ByteSpan bytes, const Reading& how) {
    const JournalLimits& limits = how.limits;
    Expected<ChangeList> list = decodeChangeList(
        bytes, how.arrays, how.absent, {.maxBytes = limits.maxRecordBytes, .maxChanges = limits.maxListChanges});
    if (!list) return tl::unexpected(list.error());
    if (Expected<void> shaped = checkColumnShapes(*list); !shaped) return tl::unexpected(shaped.error());
    return std::make_shared<const ChangeList>(std::move(*list));
}

std::vector<std::uint64_t> numbersOf(std::span<const ObjectId> ids) {
    std::vector<std::uint64_t> numbers;
    for (const ObjectId id : ids) numbers.push_back(id.value);
    return numbers;
}
Expected<std::vector<ObjectId>> idsFrom(ByteSpan bytes) {
    const Expected<std::vector<std::uint64_t>> numbers = recordsFrom<std::uint64_t>(bytes, kMaxDisplayIds);
    if (!numbers) return failWith("display", numbers.error());
    std::vector<ObjectId> ids;
    for (const std::uint64_t number : *numbers) ids.emplace_back(number);
    return ids;
}

void appendPairs(const Overlaps& overlaps, std::vector<std::uint64_t>& numbers) {
    for (const auto& [a, b] : overlaps) numbers.push_back(a.value), numbers.push_back(b.value);
}
template <typename Numbers>
Overlaps pairsFrom(const Numbers& numbers) {
    Overlaps pairs;
    for (auto it = numbers.begin(); it != numbers.end(); it += 2)
        pairs.emplace_back(ObjectId(*it), ObjectId(*(it + 1)));
    std::ranges::sort(pairs);
    return pairs;
}

/// Gives each event of a frame what touched before it.
Expected<void> takeOverlaps(ByteSpan bytes, const JournalLimits& limits, std::vector<HistoryEvent>& events) {
    const Expected<std::vector<std::uint64_t>> numbers =
        recordsFrom<std::uint64_t>(bytes, limits.maxRecordBytes / sizeof(std::uint64_t));
    if (!numbers) return failWith("overlaps", numbers.error());
    std::span<const std::uint64_t> left(*numbers);
    for (HistoryEvent& event : events) {
        if (left.empty() || left.front() > kMostOverlaps || left.size() - 1 < 2 * left.front())
            return malformed("an event's overlaps are cut off");
        event.overlaps = pairsFrom(left.subspan(1, 2 * left.front()));
        left = left.subspan(1 + 2 * left.front());
    }
    return left.empty() ? Expected<void>() : malformed("there are overlaps of no event");
}

/// Ids below the placeholders.
bool isSound(const IdRange& made) {
    return made.count < kFirstPlaceholder && made.first < kFirstPlaceholder - made.count;
}

RecordContent encode(const journal::Opening& opening) {
    wire::Opening head;
    head.set_format(opening.format);
    head.set_schema(opening.schema);
    head.set_program(opening.program);
    head.set_number(opening.number);
    head.set_epoch(opening.epoch.value);
    for (const std::string& scene : opening.scenes) head.add_scenes(scene);
    head.set_sequence(opening.sequence.value);
    head.set_state_hash(opening.stateHash.value);
    head.set_earlier_bytes(opening.before.bytes);
    if (opening.format < kLinkedFormat) return contentOf<journal::Opening>(head);
    const std::vector<LinkRecord> link{{opening.unique.low, opening.unique.high, opening.before.opening}};
    return contentOf<journal::Opening>(head, std::array{recordBytes(link)});
}
RecordContent encode(const journal::Array& array) {
    return {.kind = kindOf<journal::Array>(), .content = array.blob};
}
RecordContent encode(const journal::Frame& frame) {
    wire::Frame head;
    head.set_start(frame.start);
    head.set_frame(frame.frame.value);
    head.set_sequence(frame.sequence.value);
    head.set_state_hash(frame.stateHash.value);
    head.set_display(frame.display.has_value());
    const std::vector<std::uint64_t> display = numbersOf(frame.display.value_or(std::vector<ObjectId>()));
    std::vector<EventRecord> events;
    std::vector<Bytes> lists;
    std::vector<std::uint64_t> overlaps;
    for (const HistoryEvent& event : frame.history) {
        events.push_back({static_cast<std::uint64_t>(event.kind), event.gesture.by, event.gesture.id, event.made.first,
                          event.made.count});
        lists.push_back(event.inverse ? encodeChangeList(*event.inverse) : Bytes());
        overlaps.push_back(event.overlaps.size());
        appendPairs(event.overlaps, overlaps);
    }
    head.set_overlaps(
        std::ranges::any_of(frame.history, [](const HistoryEvent& event) { return !event.overlaps.empty(); }));
    const ByteSlice list =
        frame.sent ? frame.sent->encoded : ByteSlice(frame.list ? encodeChangeList(*frame.list) : Bytes());
    std::vector<ByteSpan> parts{list, recordBytes(display), recordBytes(events)};
    parts.insert(parts.end(), lists.begin(), lists.end());
    if (head.overlaps()) parts.push_back(recordBytes(overlaps));
    return contentOf<journal::Frame>(head, parts);
}
RecordContent encode(const journal::Frames& frames) {
    wire::Frames head;
    head.set_next(frames.next.value);
    return contentOf<journal::Frames>(head);
}
RecordContent encode(const journal::Numbers& numbers) {
    wire::Numbers head;
    head.set_next_id(numbers.nextId);
    head.set_last_list(numbers.lastList.value);
    head.set_behind(numbers.behind.value);
    return contentOf<journal::Numbers>(head);
}
RecordContent encode(const journal::View& view) {
    wire::View head;
    head.set_by_hand(view.state.byHand.has_value());
    head.set_standing(view.state.standing.has_value());
    const auto bytesOf = [](const tessera::View& what) { return encodeFrame({.view = what}); };
    const Bytes byHand = bytesOf(view.state.byHand.value_or(tessera::View()));
    const Bytes standing = bytesOf(view.state.standing.value_or(tessera::View()));
    tessera::View users;
    users.users = view.state.users;
    const Bytes heads = bytesOf(users);
    std::vector<ByteSpan> parts{byHand, standing, heads};
    std::vector<Bytes> bookmarks;
    bookmarks.reserve(view.state.bookmarks.size());
    for (std::size_t i = 0; i < view.state.bookmarks.size(); ++i) {
        if (!view.state.bookmarks[i]) continue;
        head.add_bookmarks(static_cast<std::uint32_t>(i + 1));
        parts.emplace_back(bookmarks.emplace_back(bytesOf(*view.state.bookmarks[i])));
    }
    return contentOf<journal::View>(head, parts);
}
RecordContent encode(const journal::Raised& raised) {
    wire::Raised head;
    head.set_epoch(raised.epoch.value);
    return contentOf<journal::Raised>(head);
}
RecordContent encode(const journal::Step& step) {
    wire::Step head;
    head.set_place(static_cast<std::uint32_t>(step.kept.place));
    head.set_gesture_by(step.kept.gesture.by);
    head.set_gesture(step.kept.gesture.id);
    head.set_apart(step.kept.apart);
    head.set_made_first(step.kept.made.first);
    head.set_made_count(step.kept.made.count);
    head.set_forth(step.kept.forth);
    head.set_dropped(step.kept.dropped);
    head.set_turned(step.kept.turned);
    std::vector<std::uint64_t> overlaps;
    appendPairs(step.kept.overlaps, overlaps);
    head.mutable_overlaps()->Assign(overlaps.begin(), overlaps.end());
    std::vector<Bytes> lists;
    for (const ChangeListPtr& list : step.kept.lists) lists.push_back(encodeChangeList(*list));
    const std::vector<ByteSpan> parts(lists.begin(), lists.end());
    return contentOf<journal::Step>(head, parts);
}
RecordContent encode(const journal::State& state) {
    wire::State head;
    head.set_begun(state.begun);
    head.set_next_frame(state.nextFrame.value);
    head.set_sequence(state.sequence.value);
    head.set_state_hash(state.stateHash.value);
    const Bytes list = encodeChangeList(*state.list);
    const std::vector<std::uint64_t> display = numbersOf(state.display);
    const std::array<ByteSpan, 2> parts{list, recordBytes(display)};
    return contentOf<journal::State>(head, parts);
}

Expected<JournalRecord> openingFrom(ByteSpan bytes) {
    const auto taken = take<wire::Opening>(bytes, 0, 1);
    if (!taken) return tl::unexpected(taken.error());
    const wire::Opening& head = taken->head;
    if (head.format() < 1 || head.format() > kJournalFormat)
        return fail(ErrorCode::kUnsupported, fmt::format("it is of format {}; this program reads formats up to {}",
                                                         head.format(), kJournalFormat));
    // They are printed, and a terminal obeys what is not text.
    const auto isText = [](const std::string& text, std::size_t most) {
        return text.size() <= most &&
               std::ranges::none_of(text, [](char c) { return (c >= 0 && c < ' ') || c == 127; });
    };
    if (!isText(head.program(), 256) ||
        !std::ranges::all_of(head.scenes(), [&](const auto& s) { return isText(s, 4096); }))
        return malformed("it names a program or a scene in characters that are no text");
    const bool isLinked = head.format() >= kLinkedFormat;
    if (taken->parts.size() != (isLinked ? 1U : 0U)) return malformed("its link to the log before is missing");
    LinkRecord link;
    if (isLinked) {
        const Expected<std::vector<LinkRecord>> links = recordsFrom<LinkRecord>(taken->parts[0], 1);
        if (!links || links->size() != 1) return malformed("its link to the log before cannot be read");
        link = links->front();
    }
    return journal::Opening{.schema = head.schema(),
                            .program = head.program(),
                            .number = head.number(),
                            .epoch = Epoch(head.epoch()),
                            .scenes = {head.scenes().begin(), head.scenes().end()},
                            .sequence = Sequence(head.sequence()),
                            .stateHash = StateHash(head.state_hash()),
                            .before = {.bytes = head.earlier_bytes(), .opening = link.openingBefore},
                            .unique = {.low = link.uniqueLow, .high = link.uniqueHigh},
                            .format = head.format()};
}

Expected<JournalRecord> frameFrom(ByteSpan bytes, const Reading& how) {
    const JournalLimits& limits = how.limits;
    const auto taken = take<wire::Frame>(bytes, kFixedParts, kFixedParts + limits.maxEvents + 1);
    if (!taken) return tl::unexpected(taken.error());
    const auto& [head, parts] = *taken;
    journal::Frame frame{.start = head.start(),
                         .frame = FrameNumber(head.frame()),
                         .sequence = Sequence(head.sequence()),
                         .stateHash = StateHash(head.state_hash()),
                         .list = nullptr,
                         .history = {},
                         .display = {}};
    if (!parts[0].empty()) {
        Expected<ChangeListPtr> list = listFrom(parts[0], how);
        if (!list) return failWith("list", list.error());
        frame.list = std::move(*list);
    }
    if (head.display()) {
        Expected<std::vector<ObjectId>> ids = idsFrom(parts[1]);
        if (!ids) return tl::unexpected(ids.error());
        frame.display = std::move(*ids);
    }
    const Expected<std::vector<EventRecord>> events = recordsFrom<EventRecord>(parts[2], limits.maxEvents);
    if (!events) return failWith("history", events.error());
    const std::size_t lists =
        parts.size() - kFixedParts - std::min<std::size_t>(head.overlaps(), parts.size() - kFixedParts);
    if (lists != events->size()) return malformed(fmt::format("{} events with {} lists", events->size(), lists));
    for (std::size_t i = 0; i < events->size(); ++i) {
        const EventRecord& event = (*events)[i];
        if (event.kind > static_cast<std::uint64_t>(HistoryEvent::Kind::kEditedAnew))
            return malformed("an event of the history is of a kind that is none");
        HistoryEvent happened{.kind = static_cast<HistoryEvent::Kind>(event.kind),
                              .inverse = nullptr,
                              .gesture = {event.gestureBy, event.gesture},
                              .made = {event.madeFirst, event.madeCount}};
        if (!isSound(happened.made)) return malformed("an event of the history is of ids that nobody can have");
        if (hasInverse(happened.kind)) {
            Expected<ChangeListPtr> list = listFrom(parts[kFixedParts + i], how);
            if (!list) return failWith(fmt::format("event {}", i + 1), list.error());
            happened.inverse = std::move(*list);
        }
        frame.history.push_back(std::move(happened));
    }
    if (!head.overlaps()) return frame;
    if (parts.size() != kFixedParts + lists + 1) return malformed("the part of what overlaps is missing");
    if (const Expected<void> known = takeOverlaps(parts.back(), limits, frame.history); !known)
        return tl::unexpected(known.error());
    return frame;
}

Expected<JournalRecord> viewFrom(ByteSpan bytes) {
    const auto taken = take<wire::View>(bytes, 3, 3 + std::tuple_size_v<Bookmarks>);
    if (!taken) return tl::unexpected(taken.error());
    std::vector<tessera::View> views(taken->parts.size());
    for (std::size_t i = 0; i < views.size(); ++i) {
        Expected<FramePayload> payload = decodeFrame(taken->parts[i]);
        if (!payload) return tl::unexpected(payload.error());
        views[i] = std::move(payload->view);
    }
    journal::View view;
    if (taken->head.by_hand()) view.state.byHand = views[0];
    if (taken->head.standing()) view.state.standing = views[1];
    view.state.users = std::move(views[2].users);
    if (static_cast<std::size_t>(taken->head.bookmarks_size()) != views.size() - 3)
        return malformed("bookmarks without places, or places without a number");
    for (int i = 0; i < taken->head.bookmarks_size(); ++i) {
        const std::uint32_t number = taken->head.bookmarks(i);
        if (number < 1 || number > view.state.bookmarks.size() || view.state.bookmarks[number - 1])
            return malformed("a bookmark has a number that it cannot have");
        view.state.bookmarks[number - 1] = std::move(views[static_cast<std::size_t>(i) + 3]);
    }
    return view;
}

Expected<JournalRecord> stepFrom(ByteSpan bytes, const Reading& how) {
    const auto taken = take<wire::Step>(bytes, 0, kMaxStepLists);
    if (!taken) return tl::unexpected(taken.error());
    const wire::Step& head = taken->head;
    if (head.place() > static_cast<std::uint32_t>(EditHistory::Kept::Place::kDone))
        return malformed("it stands in a place that is none");
    journal::Step step{.kept = {.place = static_cast<EditHistory::Kept::Place>(head.place()),
                                .lists = {},
                                .gesture = {head.gesture_by(), head.gesture()},
                                .apart = head.apart(),
                                .made = {head.made_first(), head.made_count()},
                                .forth = head.forth(),
                                .dropped = head.dropped(),
                                .turned = head.turned()}};
    if (!isSound(step.kept.made)) return malformed("it is of ids that nobody can have");
    if (head.overlaps_size() % 2 != 0 || static_cast<std::size_t>(head.overlaps_size()) > 2 * kMostOverlaps)
        return malformed("its overlaps are no pairs, or too many");
    step.kept.overlaps = pairsFrom(head.overlaps());
    for (const ByteSpan part : taken->parts) {
        Expected<ChangeListPtr> list = listFrom(part, how);
        if (!list) return tl::unexpected(list.error());
        step.kept.lists.push_back(std::move(*list));
    }
    return step;
}

Expected<JournalRecord> stateFrom(ByteSpan bytes, const Reading& how) {
    const auto taken = take<wire::State>(bytes, 2, 2);
    if (!taken) return tl::unexpected(taken.error());
    const auto& [head, parts] = *taken;
    Expected<ChangeListPtr> list = listFrom(parts[0], how);
    if (!list) return tl::unexpected(list.error());
    Expected<std::vector<ObjectId>> display = idsFrom(parts[1]);
    if (!display) return tl::unexpected(display.error());
    return journal::State{.begun = head.begun(),
                          .nextFrame = FrameNumber(head.next_frame()),
                          .sequence = Sequence(head.sequence()),
                          .stateHash = StateHash(head.state_hash()),
                          .list = std::move(*list),
                          .display = std::move(*display)};
}

}  // namespace

std::string_view nameOfJournalKind(std::uint64_t kind) {
    return kind < kKindNames.size() ? kKindNames[kind] : "unknown";
}

RecordContent encodeJournal(const JournalRecord& record) {
    return std::visit([](const auto& what) { return encode(what); }, record);
}

std::uint64_t kindOfArrays() {
    return kindOf<journal::Array>();
}

void forRangesIn(JournalRecord& record, ByteSpan content, const std::function<void(ChangeListPtr&, ByteSpan)>& visit) {
    std::vector<ChangeListPtr*> lists;  // each in its part
    if (auto* frame = std::get_if<journal::Frame>(&record)) {
        lists = {&frame->list, nullptr, nullptr};
        for (HistoryEvent& event : frame->history) lists.push_back(&event.inverse);
    } else if (auto* step = std::get_if<journal::Step>(&record)) {
        for (ChangeListPtr& list : step->kept.lists) lists.push_back(&list);
    }
    const auto editsRanges = [](const ChangeListPtr* list) { return list && *list && !(*list)->ranges.empty(); };
    if (std::ranges::none_of(lists, editsRanges)) return;
    const Expected<SplitParts> split = splitParts(content, kMaxHeadBytes, content.size());
    TESSERA_CHECK(split && split->parts.size() >= lists.size(), "a record was decoded from all of its parts");
    for (std::size_t i = 0; i < lists.size(); ++i)
        if (editsRanges(lists[i])) visit(*lists[i], rangeBytesIn(split->parts[i]));
}

Expected<JournalRecord> decodeJournal(std::uint64_t kind, Bytes&& content, const BlobStore& arrays,
                                      const JournalLimits& limits, AbsentBlobs absent) {
    const Reading how{arrays, limits, absent};
    switch (kind) {
        case kindOf<journal::Opening>():
            return openingFrom(content);
        case kindOf<journal::Array>():
            return journal::Array{Blob(std::move(content)).paged()};
        case kindOf<journal::Frame>():
            return frameFrom(content, how);
        case kindOf<journal::Frames>(): {
            const auto taken = take<wire::Frames>(content, 0, 0);
            if (!taken) return tl::unexpected(taken.error());
            return journal::Frames{FrameNumber(taken->head.next())};
        }
        case kindOf<journal::View>():
            return viewFrom(content);
        case kindOf<journal::Step>():
            return stepFrom(content, how);
        case kindOf<journal::Raised>(): {
            const auto taken = take<wire::Raised>(content, 0, 0);
            if (!taken) return tl::unexpected(taken.error());
            return journal::Raised{Epoch(taken->head.epoch())};
        }
        case kindOf<journal::State>():
            return stateFrom(content, how);
        case kindOf<journal::Numbers>(): {
            const auto taken = take<wire::Numbers>(content, 0, 0);
            if (!taken) return tl::unexpected(taken.error());
            // There must be room to go on.
            constexpr std::uint64_t kMost = kFirstPlaceholder / 2;
            const wire::Numbers& head = taken->head;
            if (head.next_id() > kMost || head.last_list() > kMost || head.behind() > kMost)
                return malformed("its numbers are beyond all that are given");
            return journal::Numbers{
                .nextId = head.next_id(), .lastList = Sequence(head.last_list()), .behind = Sequence(head.behind())};
        }
        default:
            return malformed(fmt::format("kind {} is none", kind));
    }
}

}  // namespace tessera
