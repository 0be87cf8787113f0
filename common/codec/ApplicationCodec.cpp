#include "common/codec/ApplicationCodec.h"

#include <fmt/format.h>

#include "common/codec/ApplicationNavigationParts.h"
#include "common/codec/ApplicationSceneHeads.h"
#include "common/codec/ApplicationStatusParts.h"
#include "common/codec/ApplicationTrackingParts.h"
#include "common/codec/ApplicationUnpacker.h"
#include "common/wall/Wall.h"
#include "proto/application.pb.h"

namespace tessera {

namespace {

namespace pb = proto::application;

constexpr std::size_t kMaxApplicationHeadBytes = std::size_t{1} << 20;

/// Records as they stand in the parts.
struct IdPair {
    std::uint64_t placeholder, id;
};

using Parts = std::vector<ByteSpan>;

void put(pb::Vector* out, const Vec3d& v) {
    out->set_x(v.x());
    out->set_y(v.y());
    out->set_z(v.z());
}
void put(pb::Contacts* out, const answer::Contacts& contacts) {
    out->set_frame(contacts.frame.value);
    out->set_begun(contacts.begun);
    out->set_left_out(contacts.leftOut);
    out->set_not_looked_at(contacts.notLookedAt);
}
void put(pb::PairEvents* out, const answer::PairEvents& events) {
    out->set_frame(events.frame.value);
    out->set_left_out(events.leftOut);
}
void put(pb::Distances* out, const answer::Distances& distances) {
    out->set_frame(distances.frame.value);
    out->set_left_out(distances.leftOut);
}
void put(pb::Questions* out, const answer::Questions& questions) {
    out->set_frame(questions.frame.value);
    out->set_unanswered(questions.unanswered);
}
void put(pb::Rotation* out, const Quatd& q) {
    out->set_w(q.w());
    out->set_x(q.x());
    out->set_y(q.y());
    out->set_z(q.z());
}

/// Splits, parses and unpacks; `unpack(head, in)` gives the value.
template <typename Head, typename Unpack>
auto decode(const ByteSlice& bytes, std::string_view what, std::size_t maxParts, const ApplicationLimits& limits,
            Unpack unpack)
    -> Expected<decltype(unpack(std::declval<const Head&>(), std::declval<ApplicationUnpacker&>()))> {
    auto split = splitParts(bytes, kMaxApplicationHeadBytes, maxParts);
    if (!split) return failWith(fmt::format("a malformed {}", what), split.error());
    Head head;
    if (!head.ParseFromArray(split->head.data(), static_cast<int>(split->head.size())))
        return fail(ErrorCode::kBadInput, fmt::format("a malformed {}: its head is no protobuf message", what));
    ApplicationUnpacker in(bytes, std::move(split->parts), limits);
    auto value = unpack(head, in);
    if (in.error()) return failWith(fmt::format("a malformed {}", what), *in.error());
    return value;
}

// ---- requests

void pack(const request::ProposeChanges& r, pb::RequestHead& head, Parts& parts) {
    head.mutable_propose()->set_gesture(r.gesture);
    parts.push_back(r.list);
    for (const ByteSlice& blob : r.blobs) parts.push_back(blob);
}
void pack(const request::UndoStep&, pb::RequestHead& head, Parts&) {
    head.mutable_undo();
}
void pack(const request::RedoStep&, pb::RequestHead& head, Parts&) {
    head.mutable_redo();
}
void pack(const request::GetStatus&, pb::RequestHead& head, Parts&) {
    head.mutable_get_status();
}
void pack(const request::LoadFile& r, pb::RequestHead& head, Parts&) {
    putLoad(*head.mutable_load(), r);
}
void pack(const request::SetView& r, pb::RequestHead& head, Parts&) {
    pb::SetView& out = *head.mutable_set_view();
    if (r.position) put(out.mutable_position(), *r.position);
    if (r.orientation) put(out.mutable_orientation(), *r.orientation);
    if (r.worldUnitsPerMetre) out.set_world_units_per_metre(*r.worldUnitsPerMetre);
    out.set_user(r.user);
    if (r.head) put(out.mutable_head(), *r.head);
    out.set_reset(r.reset);
}
void pack(const request::PickAt& r, pb::RequestHead& head, Parts&) {
    head.mutable_pick()->set_x_px(r.xPx);
    head.mutable_pick()->set_y_px(r.yPx);
    head.mutable_pick()->set_wand(r.wand);
}
void pack(const request::GetContacts&, pb::RequestHead& head, Parts&) {
    head.mutable_get_contacts();
}
void pack(const request::GetImages&, pb::RequestHead& head, Parts&) {
    head.mutable_get_images();
}
void pack(const request::SubscribeNews& r, pb::RequestHead& head, Parts&) {
    pb::Subscribe& out = *head.mutable_subscribe();
    out.set_contacts(r.contacts);
    out.set_picks(r.picks);
    out.set_frames(r.frames);
    out.set_events(r.events);
    out.set_stays(r.stays);
    out.set_distances(r.distances);
    out.set_questions(r.questions);
    out.set_poses(r.poses);
}
void pack(const request::GetEvents&, pb::RequestHead& head, Parts&) {
    head.mutable_get_events();
}
void pack(const request::GetDistances&, pb::RequestHead& head, Parts&) {
    head.mutable_get_distances();
}
void pack(const request::GetQuestions&, pb::RequestHead& head, Parts&) {
    head.mutable_get_questions();
}
void pack(const request::AnswerQuestion& r, pb::RequestHead& head, Parts&) {
    pb::Respond& out = *head.mutable_respond();
    out.set_question(r.question);
    out.set_decision(static_cast<std::uint32_t>(r.decision));
    if (r.decision != request::AnswerQuestion::Decision::kMove) return;
    put(out.mutable_translation(), r.pose.translation);
    put(out.mutable_rotation(), r.pose.rotation);
    put(out.mutable_scale(), r.pose.scale);
}

void pack(const request::GetObjects& r, pb::RequestHead& head, Parts&) {
    pb::GetObjects& out = *head.mutable_get_objects();
    for (const std::string& name : r.names) out.add_names(name);
    out.set_content(r.content);
    out.set_paths(r.paths);
}
void pack(const request::GetTree& r, pb::RequestHead& head, Parts& parts) {
    putGetTree(*head.mutable_get_tree(), r);
    parts = {recordBytes(r.after), recordBytes(r.cores)};
}
void pack(const request::RemoveNode& r, pb::RequestHead& head, Parts&) {
    head.mutable_remove()->set_node(r.node.value);
}
void pack(const request::CloneNode& r, pb::RequestHead& head, Parts&) {
    putClone(*head.mutable_clone(), r);
}
void pack(const request::FindNodes& r, pb::RequestHead& head, Parts& parts) {
    putFind(*head.mutable_find(), r);
    parts = {recordBytes(r.after)};
}
void pack(const request::Manipulate& r, pb::RequestHead& head, Parts&) {
    putManipulate(*head.mutable_manipulate(), r);
}
void pack(const request::MoveNode& r, pb::RequestHead& head, Parts&) {
    putMove(*head.mutable_move(), r);
}
void pack(const request::GetTrackers&, pb::RequestHead& head, Parts&) {
    head.mutable_get_trackers();
}
void pack(const request::ShowPicture& r, pb::RequestHead& head, Parts&) {
    head.mutable_show()->set_showing(static_cast<std::uint32_t>(r.showing));
}

void pack(const request::SetBudget& r, pb::RequestHead& head, Parts&) {
    head.mutable_set_budget()->set_milliseconds(r.milliseconds);
}
void pack(const request::NavigateView& r, pb::RequestHead& head, Parts& parts) {
    putNavigate(*head.mutable_navigate(), r);
    parts = {r.input ? std::as_bytes(std::span(&*r.input, 1)) : ByteSpan()};
}

ApplicationRequest unpackPropose(const pb::Propose& head, ApplicationUnpacker& in) {
    request::ProposeChanges out;
    out.gesture = head.gesture();
    if (in.partCount() == 0) {
        in.refuse(ErrorCode::kBadInput, "a proposal without a list");
        return out;
    }
    out.list = in.bytes(0);
    out.blobs.reserve(in.partCount() - 1);
    for (std::size_t i = 1; i < in.partCount(); ++i) out.blobs.push_back(in.bytes(i));
    return out;
}

ApplicationRequest unpackSetView(const pb::SetView& head, ApplicationUnpacker& in) {
    request::SetView out;
    if (head.has_position()) out.position = in.vector(head.position());
    if (head.has_orientation()) out.orientation = in.rotation(head.orientation());
    if (head.has_world_units_per_metre()) {
        out.worldUnitsPerMetre = in.finite(head.world_units_per_metre());
        if (!(*out.worldUnitsPerMetre > 0)) in.refuse(ErrorCode::kBadInput, "a scale that is not above zero");
    }
    out.user = in.text(head.user());
    if (head.has_head()) out.head = in.vector(head.head());
    out.reset = head.reset();
    return out;
}

ApplicationRequest unpackSubscribe(const pb::Subscribe& head) {
    return request::SubscribeNews{.contacts = head.contacts(),
                                  .picks = head.picks(),
                                  .frames = head.frames(),
                                  .events = head.events(),
                                  .stays = head.stays(),
                                  .distances = head.distances(),
                                  .questions = head.questions(),
                                  .poses = head.poses()};
}

ApplicationRequest unpackRespond(const pb::Respond& head, ApplicationUnpacker& in) {
    using Decision = request::AnswerQuestion::Decision;
    request::AnswerQuestion out;
    out.question = head.question();
    if (head.decision() > static_cast<std::uint32_t>(Decision::kMove)) {
        in.refuse(ErrorCode::kUnsupported, "a decision that this version does not know");
        return out;
    }
    out.decision = static_cast<Decision>(head.decision());
    if (out.decision != Decision::kMove) return out;
    out.pose = {in.vector(head.translation()), in.rotation(head.rotation()), in.vector(head.scale())};
    if ((out.pose.scale.array() == 0).any()) in.refuse(ErrorCode::kBadInput, "a scale of zero");
    return out;
}

ApplicationRequest unpackRequest(const pb::RequestHead& head, ApplicationUnpacker& in) {
    const bool hasParts =
        head.what_case() == pb::RequestHead::kPropose || head.what_case() == pb::RequestHead::kGetTree ||
        head.what_case() == pb::RequestHead::kNavigate || head.what_case() == pb::RequestHead::kFind;
    if (!hasParts) in.expectParts(0);
    switch (head.what_case()) {
        case pb::RequestHead::kPropose:
            return unpackPropose(head.propose(), in);
        case pb::RequestHead::kUndo:
            return request::UndoStep{};
        case pb::RequestHead::kRedo:
            return request::RedoStep{};
        case pb::RequestHead::kGetStatus:
            return request::GetStatus{};
        case pb::RequestHead::kLoad:
            return readLoad(head.load(), in);
        case pb::RequestHead::kSetView:
            return unpackSetView(head.set_view(), in);
        case pb::RequestHead::kPick:
            return request::PickAt{in.finite(head.pick().x_px()), in.finite(head.pick().y_px()),
                                   in.text(head.pick().wand())};
        case pb::RequestHead::kManipulate:
            return readManipulate(head.manipulate(), in);
        case pb::RequestHead::kMove:
            return readMove(head.move(), in);
        case pb::RequestHead::kGetContacts:
            return request::GetContacts{};
        case pb::RequestHead::kGetImages:
            return request::GetImages{};
        case pb::RequestHead::kSubscribe:
            return unpackSubscribe(head.subscribe());
        case pb::RequestHead::kGetEvents:
            return request::GetEvents{};
        case pb::RequestHead::kGetDistances:
            return request::GetDistances{};
        case pb::RequestHead::kGetQuestions:
            return request::GetQuestions{};
        case pb::RequestHead::kRespond:
            return unpackRespond(head.respond(), in);
        case pb::RequestHead::kGetObjects:
            return request::GetObjects{.names = in.texts(head.get_objects().names(), in.limits().maxNames),
                                       .paths = head.get_objects().paths(),
                                       .content = head.get_objects().content()};
        case pb::RequestHead::kGetTree:
            return readGetTree(head.get_tree(), in);
        case pb::RequestHead::kRemove:
            return request::RemoveNode{ObjectId{head.remove().node()}};
        case pb::RequestHead::kClone:
            return readClone(head.clone(), in);
        case pb::RequestHead::kFind:
            return readFind(head.find(), in);
        case pb::RequestHead::kGetTrackers:
            return request::GetTrackers{};
        case pb::RequestHead::kShow:
            if (head.show().showing() > kLastShowing) in.refuse(ErrorCode::kUnsupported, "something to show that this version does not know");
            return request::ShowPicture{static_cast<Showing>(head.show().showing())};
        case pb::RequestHead::kSetBudget:
            if (!isBudget(head.set_budget().milliseconds())) in.refuse(ErrorCode::kBadInput, fmt::format("a budget of {} ms for a frame: 0, which is none, and 0.1 to 60000 are possible", head.set_budget().milliseconds()));
            return request::SetBudget{head.set_budget().milliseconds()};
        case pb::RequestHead::kNavigate:
            return readNavigate(head.navigate(), in);
        case pb::RequestHead::WHAT_NOT_SET:
            break;
    }
    in.refuse(ErrorCode::kUnsupported, "it asks for something that this version does not know");
    return request::UndoStep{};
}

// ---- collisions, in answers and in notices

Bytes joinPart(const google::protobuf::MessageLite& head, const Bytes& part) {
    return joinParts(head, std::array{ByteSpan(part)});
}
template <typename Head>
Bytes join(const answer::Contacts& a, Head& head) {
    put(head.mutable_contacts(), a);
    return joinPart(head, packContacts(a.contacts));
}
template <typename Head>
Bytes join(const answer::PairEvents& a, Head& head) {
    put(head.mutable_events(), a);
    return joinPart(head, packEvents(a.events));
}
template <typename Head>
Bytes join(const answer::Distances& a, Head& head) {
    put(head.mutable_distances(), a);
    return joinPart(head, packDistances(a.distances));
}
template <typename Head>
Bytes join(const answer::Questions& a, Head& head) {
    put(head.mutable_questions(), a);
    const Bytes questions = packQuestions(a.questions);
    return joinParts(head, std::array{ByteSpan(questions), recordBytes(a.closed)});
}

// ---- answers

Bytes join(const answer::Done&, pb::AnswerHead& head) {
    head.mutable_done();
    return joinParts(head, {});
}
Bytes join(const answer::Committed& a, pb::AnswerHead& head) {
    head.mutable_committed()->set_sequence(a.sequence.value);
    head.mutable_committed()->set_removed(a.removed);
    head.mutable_committed()->set_created(a.created);
    std::vector<IdPair> ids;
    ids.reserve(a.ids.size());
    for (const auto& [placeholder, id] : a.ids) ids.push_back({placeholder.value, id.value});
    std::vector<std::uint64_t> stopped;
    stopped.reserve(a.stopped.size());
    for (const ObjectId id : a.stopped) stopped.push_back(id.value);
    return joinParts(head, std::array{recordBytes(ids), recordBytes(stopped)});
}
Bytes join(const answer::Status& a, pb::AnswerHead& head) {
    putStatus(*head.mutable_status(), a);
    return joinParts(head, {});
}
Bytes join(const answer::Loaded& a, pb::AnswerHead& head) {
    head.mutable_loaded()->set_node(a.node.value);
    head.mutable_loaded()->set_objects(a.objects);
    head.mutable_loaded()->set_triangles(a.triangles);
    for (const std::string& note : a.notes) head.mutable_loaded()->add_notes(note);
    return joinParts(head, {});
}
Bytes join(const answer::Picked& a, pb::AnswerHead& head) {
    putPicked(*head.mutable_picked(), a);
    return joinParts(head, {});
}
Bytes join(const answer::Images& a, pb::AnswerHead& head) {
    Parts pngs;
    for (const answer::TileImageValue& image : a.tiles) {
        pb::TileImage& out = *head.mutable_images()->add_tiles();
        out.set_tile(image.tile);
        out.set_host(image.host);
        out.set_frame(image.frame.value);
        pngs.push_back(image.png);
    }
    for (const std::string& name : a.missing) head.mutable_images()->add_missing(name);
    if (a.tiles.empty()) head.mutable_images();
    return joinParts(head, pngs);
}

Bytes join(const answer::Objects& a, pb::AnswerHead& head) {
    head.mutable_objects()->set_sequence(a.sequence.value);
    const PackedObjects packed = packObjects(a.objects);
    return joinParts(head, std::array<ByteSpan, 3>{packed.records, packed.texts, a.content});
}
Bytes join(const answer::TreePage& a, pb::AnswerHead& head) {
    head.mutable_tree_page()->set_sequence(a.sequence.value);
    for (const PlayLength& length : a.lengths) {
        pb::Length& to = *head.mutable_tree_page()->add_lengths();
        to.set_core(length.core.value);
        to.set_seconds(length.seconds);
    }
    const Bytes nodes = packTree(a.nodes);
    return joinParts(head, std::array<ByteSpan, 3>{nodes, recordBytes(a.next), a.content});
}
Bytes join(const answer::FoundPage& a, pb::AnswerHead& head) {
    head.mutable_found_page()->set_sequence(a.sequence.value);
    head.mutable_found_page()->set_looked_at(a.lookedAt);
    const PackedObjects packed = packObjects(a.nodes);
    return joinParts(head, std::array<ByteSpan, 3>{packed.records, packed.texts, recordBytes(a.next)});
}

Bytes join(const answer::Trackers& a, pb::AnswerHead& head) {
    putTrackers(*head.mutable_trackers(), a);
    return joinParts(head, {});
}

answer::Committed unpackCommitted(const pb::Committed& head, ApplicationUnpacker& in) {
    in.expectParts(2);
    answer::Committed out{Sequence{head.sequence()}, {}, {}, head.removed(), head.created()};
    const auto ids = in.records<IdPair>(0, in.limits().maxIds);
    out.ids.reserve(ids.size());
    for (const IdPair& pair : ids) out.ids.emplace_back(ObjectId{pair.placeholder}, ObjectId{pair.id});
    const auto stopped = in.records<std::uint64_t>(1, in.limits().maxIds);
    out.stopped.reserve(stopped.size());
    for (const std::uint64_t id : stopped) out.stopped.emplace_back(id);
    return out;
}

answer::Images unpackImages(const pb::Images& head, ApplicationUnpacker& in) {
    answer::Images out;
    const auto count = static_cast<std::size_t>(head.tiles_size());
    in.expectParts(count);
    for (std::size_t i = 0; i < count; ++i) {
        const pb::TileImage& image = head.tiles(static_cast<int>(i));
        out.tiles.push_back({in.text(image.tile()), in.text(image.host()), FrameNumber(image.frame()), in.bytes(i)});
    }
    out.missing = in.texts(head.missing(), in.limits().maxTiles);
    return out;
}

ApplicationAnswer unpackAnswer(const pb::AnswerHead& head, ApplicationUnpacker& in) {
    switch (head.what_case()) {
        case pb::AnswerHead::kDone:
            in.expectParts(0);
            return answer::Done{};
        case pb::AnswerHead::kCommitted:
            return unpackCommitted(head.committed(), in);
        case pb::AnswerHead::kStatus:
            return readStatus(head.status(), in);
        case pb::AnswerHead::kLoaded:
            in.expectParts(0);
            return answer::Loaded{ObjectId{head.loaded().node()}, head.loaded().objects(), head.loaded().triangles(),
                                  in.texts(head.loaded().notes(), answer::Loaded::kMostNotes)};
        case pb::AnswerHead::kPicked:
            in.expectParts(0);
            return readPicked(head.picked(), in);
        case pb::AnswerHead::kContacts:
            return in.contacts(head.contacts());
        case pb::AnswerHead::kImages:
            return unpackImages(head.images(), in);
        case pb::AnswerHead::kEvents:
            return in.events(head.events());
        case pb::AnswerHead::kDistances:
            return in.distances(head.distances());
        case pb::AnswerHead::kQuestions:
            return in.questions(head.questions());
        case pb::AnswerHead::kObjects:
            return in.objects(head.objects());
        case pb::AnswerHead::kTreePage:
            return in.treePage(head.tree_page());
        case pb::AnswerHead::kFoundPage:
            return in.foundPage(head.found_page());
        case pb::AnswerHead::kTrackers:
            in.expectParts(0);
            return readTrackers(head.trackers(), in);
        case pb::AnswerHead::WHAT_NOT_SET:
            break;
    }
    in.refuse(ErrorCode::kUnsupported, "it says something that this version does not know");
    return answer::Done{};
}

// ---- notices

Bytes join(const notice::Frame& n, pb::NoticeHead& head) {
    head.mutable_frame()->set_frame(n.frame.value);
    for (const std::string& name : n.shown) head.mutable_frame()->add_shown(name);
    for (const std::string& name : n.held) head.mutable_frame()->add_held(name);
    return joinParts(head, {});
}
Bytes join(const answer::Picked& n, pb::NoticeHead& head) {
    putPicked(*head.mutable_picked(), n);
    return joinParts(head, {});
}

Bytes join(const notice::Poses& n, pb::NoticeHead& head) {
    putPoses(*head.mutable_poses(), n);
    return joinParts(head, {});
}

ApplicationNotice unpackNotice(const pb::NoticeHead& head, ApplicationUnpacker& in) {
    switch (head.what_case()) {
        case pb::NoticeHead::kFrame:
            in.expectParts(0);
            return notice::Frame{FrameNumber(head.frame().frame()),
                                 in.texts(head.frame().shown(), in.limits().maxHosts),
                                 in.texts(head.frame().held(), in.limits().maxHosts)};
        case pb::NoticeHead::kContacts:
            return in.contacts(head.contacts());
        case pb::NoticeHead::kPicked:
            in.expectParts(0);
            return readPicked(head.picked(), in);
        case pb::NoticeHead::kEvents:
            return in.events(head.events());
        case pb::NoticeHead::kDistances:
            return in.distances(head.distances());
        case pb::NoticeHead::kQuestions:
            return in.questions(head.questions());
        case pb::NoticeHead::kPoses:
            in.expectParts(0);
            return readPoses(head.poses(), in);
        case pb::NoticeHead::WHAT_NOT_SET:
            break;
    }
    in.refuse(ErrorCode::kUnsupported, "it says something that this version does not know");
    return notice::Frame{};
}

}  // namespace

Bytes encodeRequest(const ApplicationRequest& request) {
    pb::RequestHead head;
    Parts parts;
    std::visit([&](const auto& r) { pack(r, head, parts); }, request);
    return joinParts(head, parts);
}

Expected<ApplicationRequest> decodeRequest(const ByteSlice& bytes, const ApplicationLimits& limits) {
    return decode<pb::RequestHead>(bytes, "request", limits.maxBlobs + 1, limits, unpackRequest);
}

Bytes encodeAnswer(const ApplicationAnswer& answer) {
    pb::AnswerHead head;
    return std::visit([&](const auto& a) { return join(a, head); }, answer);
}

Expected<ApplicationAnswer> decodeAnswer(const ByteSlice& bytes, const ApplicationLimits& limits) {
    return decode<pb::AnswerHead>(bytes, "answer", limits.maxTiles, limits, unpackAnswer);
}

Bytes encodeNotice(const ApplicationNotice& notice) {
    pb::NoticeHead head;
    return std::visit([&](const auto& n) { return join(n, head); }, notice);
}

Expected<ApplicationNotice> decodeNotice(const ByteSlice& bytes, const ApplicationLimits& limits) {
    return decode<pb::NoticeHead>(bytes, "notice", 2, limits, unpackNotice);
}

}  // namespace tessera
