#include "common/codec/ApplicationCodec.h"

#include <fmt/format.h>

#include <cmath>

#include "common/codec/Parts.h"
#include "proto/application.pb.h"

namespace tessera {

namespace {

namespace pb = proto::application;

constexpr std::size_t kMaxHeadBytes = std::size_t{1} << 20;

/// Records as they stand in the parts.
struct IdPair {
    std::uint64_t placeholder, id;
};
struct ContactRecord {
    std::uint64_t objectA, objectB;
    std::uint32_t faceA, faceB;
    std::uint64_t point[3], normal[3];  ///< the bits of doubles: compared and copied as integers
};
static_assert(sizeof(ContactRecord) == 72);

using Parts = std::vector<ByteSpan>;

ByteSpan spanOf(const SharedBytes& bytes) {
    return bytes ? ByteSpan(*bytes) : ByteSpan();
}
SharedBytes copyOf(ByteSpan bytes) {
    return share(Bytes(bytes.begin(), bytes.end()));
}

void put(pb::Vector* out, const Vec3d& v) {
    out->set_x(v.x());
    out->set_y(v.y());
    out->set_z(v.z());
}
void put(pb::Picked* out, const answer::Picked& picked) {
    out->set_hit(picked.hit);
    out->set_node(picked.node.value);
    out->set_face(picked.face);
    put(out->mutable_point(), picked.point);
    out->set_x_px(picked.xPx);
    out->set_y_px(picked.yPx);
}
void put(pb::Contacts* out, const answer::Contacts& contacts, std::vector<ContactRecord>& records) {
    out->set_frame(contacts.frame);
    out->set_begun(contacts.begun);
    records.reserve(contacts.contacts.size());
    for (const ContactValue& c : contacts.contacts) {
        ContactRecord& r = records.emplace_back();
        r.objectA = c.objectA.value;
        r.objectB = c.objectB.value;
        r.faceA = c.faceA;
        r.faceB = c.faceB;
        for (int i = 0; i < 3; ++i) {
            r.point[i] = std::bit_cast<std::uint64_t>(c.point[i]);
            r.normal[i] = std::bit_cast<std::uint64_t>(c.normal[i]);
        }
    }
}

/// Checks what a head says; keeps the first thing that is wrong.
class Unpacker {
public:
    Unpacker(Parts parts, const ApplicationLimits& limits) : parts_(std::move(parts)), limits_(limits) {}

    [[nodiscard]] const std::optional<Error>& error() const { return error_; }
    [[nodiscard]] const ApplicationLimits& limits() const { return limits_; }
    [[nodiscard]] std::size_t partCount() const { return parts_.size(); }
    [[nodiscard]] ByteSpan part(std::size_t i) const { return parts_[i]; }

    void refuse(ErrorCode code, std::string message) {
        if (!error_) error_ = Error{code, std::move(message)};
    }
    void expectParts(std::size_t count) {
        if (parts_.size() == count) return;
        refuse(ErrorCode::kBadInput, fmt::format("it has {} parts instead of {}", parts_.size(), count));
        parts_.resize(count);
    }
    bool within(std::size_t count, std::size_t most, std::string_view what) {
        if (count > most) refuse(ErrorCode::kLimit, fmt::format("{} {}; at most {} are allowed", count, what, most));
        return count <= most;
    }
    std::string text(const std::string& value) {
        return within(value.size(), limits_.maxTextBytes, "bytes of text") ? value : std::string();
    }
    template <typename Texts>
    std::vector<std::string> texts(const Texts& values, std::size_t most) {
        std::vector<std::string> out;
        if (!within(static_cast<std::size_t>(values.size()), most, "names")) return out;
        for (const std::string& value : values) out.push_back(text(value));
        return out;
    }
    double finite(double value) {
        if (!std::isfinite(value)) refuse(ErrorCode::kBadInput, "a number that is not finite");
        return value;
    }
    Vec3d vector(const pb::Vector& v) { return {finite(v.x()), finite(v.y()), finite(v.z())}; }
    Quatd rotation(const pb::Rotation& r) {
        const Quatd q(finite(r.w()), finite(r.x()), finite(r.y()), finite(r.z()));
        if (!(q.squaredNorm() > 0) || !std::isfinite(q.squaredNorm()))
            refuse(ErrorCode::kBadInput, "a quaternion of no length");
        return q;
    }
    template <typename Record>
    std::vector<Record> records(std::size_t part, std::size_t most) {
        auto found = recordsFrom<Record>(parts_[part], most);
        if (found) return std::move(*found);
        refuse(found.error().code, found.error().message);
        return {};
    }
    answer::Picked picked(const pb::Picked& p) {
        return {p.hit(), ObjectId{p.node()}, p.face(), vector(p.point()), finite(p.x_px()), finite(p.y_px())};
    }
    answer::Contacts contacts(const pb::Contacts& head) {
        expectParts(1);
        answer::Contacts out{head.frame(), head.begun(), {}};
        for (const ContactRecord& r : records<ContactRecord>(0, limits_.maxContacts)) {
            ContactValue& c = out.contacts.emplace_back();
            c = {ObjectId{r.objectA}, ObjectId{r.objectB}, r.faceA, r.faceB};
            for (int i = 0; i < 3; ++i) {
                c.point[i] = finite(std::bit_cast<double>(r.point[i]));
                c.normal[i] = finite(std::bit_cast<double>(r.normal[i]));
            }
        }
        return out;
    }

private:
    Parts parts_;
    const ApplicationLimits& limits_;
    std::optional<Error> error_;
};

/// Splits, parses and unpacks; `unpack(head, in)` gives the value.
template <typename Head, typename Unpack>
auto decode(ByteSpan bytes, std::string_view what, std::size_t maxParts, const ApplicationLimits& limits, Unpack unpack)
    -> Expected<decltype(unpack(std::declval<const Head&>(), std::declval<Unpacker&>()))> {
    auto split = splitParts(bytes, kMaxHeadBytes, maxParts);
    if (!split) return failWith(fmt::format("a malformed {}", what), split.error());
    Head head;
    if (!head.ParseFromArray(split->head.data(), static_cast<int>(split->head.size())))
        return fail(ErrorCode::kBadInput, fmt::format("a malformed {}: its head is no protobuf message", what));
    Unpacker in(std::move(split->parts), limits);
    auto value = unpack(head, in);
    if (in.error()) return failWith(fmt::format("a malformed {}", what), *in.error());
    return value;
}

// ---- requests

void pack(const request::Propose& r, pb::RequestHead& head, Parts& parts) {
    head.mutable_propose();
    parts.push_back(spanOf(r.list));
    for (const SharedBytes& blob : r.blobs) parts.push_back(spanOf(blob));
}
void pack(const request::Undo&, pb::RequestHead& head, Parts&) {
    head.mutable_undo();
}
void pack(const request::GetStatus&, pb::RequestHead& head, Parts&) {
    head.mutable_get_status();
}
void pack(const request::Load& r, pb::RequestHead& head, Parts&) {
    head.mutable_load()->set_path(r.path);
    head.mutable_load()->set_parent(r.parent.value);
}
void pack(const request::SetView& r, pb::RequestHead& head, Parts&) {
    pb::SetView& out = *head.mutable_set_view();
    if (r.position) put(out.mutable_position(), *r.position);
    if (r.orientation) {
        out.mutable_orientation()->set_w(r.orientation->w());
        out.mutable_orientation()->set_x(r.orientation->x());
        out.mutable_orientation()->set_y(r.orientation->y());
        out.mutable_orientation()->set_z(r.orientation->z());
    }
    if (r.worldUnitsPerMetre) out.set_world_units_per_metre(*r.worldUnitsPerMetre);
    out.set_user(r.user);
    if (r.head) put(out.mutable_head(), *r.head);
    out.set_reset(r.reset);
}
void pack(const request::Pick& r, pb::RequestHead& head, Parts&) {
    head.mutable_pick()->set_x_px(r.xPx);
    head.mutable_pick()->set_y_px(r.yPx);
}
void pack(const request::GetContacts&, pb::RequestHead& head, Parts&) {
    head.mutable_get_contacts();
}
void pack(const request::GetImages&, pb::RequestHead& head, Parts&) {
    head.mutable_get_images();
}
void pack(const request::Subscribe& r, pb::RequestHead& head, Parts&) {
    head.mutable_subscribe()->set_contacts(r.contacts);
    head.mutable_subscribe()->set_picks(r.picks);
    head.mutable_subscribe()->set_frames(r.frames);
}

ApplicationRequest unpackPropose(Unpacker& in) {
    request::Propose out;
    if (in.partCount() == 0) {
        in.refuse(ErrorCode::kBadInput, "a proposal without a list");
        return out;
    }
    out.list = copyOf(in.part(0));
    out.blobs.reserve(in.partCount() - 1);
    for (std::size_t i = 1; i < in.partCount(); ++i) out.blobs.push_back(copyOf(in.part(i)));
    return out;
}

ApplicationRequest unpackSetView(const pb::SetView& head, Unpacker& in) {
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

ApplicationRequest unpackRequest(const pb::RequestHead& head, Unpacker& in) {
    if (head.what_case() != pb::RequestHead::kPropose) in.expectParts(0);
    switch (head.what_case()) {
        case pb::RequestHead::kPropose:
            return unpackPropose(in);
        case pb::RequestHead::kUndo:
            return request::Undo{};
        case pb::RequestHead::kGetStatus:
            return request::GetStatus{};
        case pb::RequestHead::kLoad:
            return request::Load{in.text(head.load().path()), ObjectId{head.load().parent()}};
        case pb::RequestHead::kSetView:
            return unpackSetView(head.set_view(), in);
        case pb::RequestHead::kPick:
            return request::Pick{in.finite(head.pick().x_px()), in.finite(head.pick().y_px())};
        case pb::RequestHead::kGetContacts:
            return request::GetContacts{};
        case pb::RequestHead::kGetImages:
            return request::GetImages{};
        case pb::RequestHead::kSubscribe:
            return request::Subscribe{head.subscribe().contacts(), head.subscribe().picks(), head.subscribe().frames()};
        case pb::RequestHead::WHAT_NOT_SET:
            break;
    }
    in.refuse(ErrorCode::kUnsupported, "it asks for something that this version does not know");
    return request::Undo{};
}

// ---- answers

Bytes join(const answer::Done&, pb::AnswerHead& head) {
    head.mutable_done();
    return joinParts(head, {});
}
Bytes join(const answer::Committed& a, pb::AnswerHead& head) {
    head.mutable_committed()->set_sequence(a.sequence.value);
    std::vector<IdPair> ids;
    ids.reserve(a.ids.size());
    for (const auto& [placeholder, id] : a.ids) ids.push_back({placeholder.value, id.value});
    std::vector<std::uint64_t> stopped;
    stopped.reserve(a.stopped.size());
    for (const ObjectId id : a.stopped) stopped.push_back(id.value);
    return joinParts(head, std::array{recordBytes(ids), recordBytes(stopped)});
}
Bytes join(const answer::Status& a, pb::AnswerHead& head) {
    pb::Status& out = *head.mutable_status();
    out.set_wall_name(a.wallName);
    out.set_epoch(a.epoch);
    out.set_frame(a.frame);
    out.set_sequence(a.sequence);
    out.set_state_hash(a.stateHash);
    for (const answer::HostInfo& host : a.hosts) {
        pb::HostInfo& info = *out.add_hosts();
        info.set_name(host.name);
        info.set_state(host.state);
        info.set_last_shown(host.lastShown);
        info.set_round_trip_ms(host.roundTripMs);
    }
    for (const std::string& name : a.waitingFor) out.add_waiting_for(name);
    out.set_objects(a.objects);
    out.set_nodes(a.nodes);
    out.set_undo_depth(a.undoDepth);
    out.set_applications(a.applications);
    return joinParts(head, {});
}
Bytes join(const answer::Loaded& a, pb::AnswerHead& head) {
    head.mutable_loaded()->set_node(a.node.value);
    head.mutable_loaded()->set_objects(a.objects);
    head.mutable_loaded()->set_triangles(a.triangles);
    return joinParts(head, {});
}
Bytes join(const answer::Picked& a, pb::AnswerHead& head) {
    put(head.mutable_picked(), a);
    return joinParts(head, {});
}
Bytes join(const answer::Contacts& a, pb::AnswerHead& head) {
    std::vector<ContactRecord> records;
    put(head.mutable_contacts(), a, records);
    return joinParts(head, std::array{recordBytes(records)});
}
Bytes join(const answer::Images& a, pb::AnswerHead& head) {
    Parts pngs;
    for (const answer::TileImageValue& image : a.tiles) {
        pb::TileImage& out = *head.mutable_images()->add_tiles();
        out.set_tile(image.tile);
        out.set_host(image.host);
        out.set_frame(image.frame);
        pngs.push_back(spanOf(image.png));
    }
    for (const std::string& name : a.missing) head.mutable_images()->add_missing(name);
    if (a.tiles.empty()) head.mutable_images();
    return joinParts(head, pngs);
}

answer::Committed unpackCommitted(const pb::Committed& head, Unpacker& in) {
    in.expectParts(2);
    answer::Committed out{Sequence{head.sequence()}, {}, {}};
    const auto ids = in.records<IdPair>(0, in.limits().maxIds);
    out.ids.reserve(ids.size());
    for (const IdPair& pair : ids) out.ids.emplace_back(ObjectId{pair.placeholder}, ObjectId{pair.id});
    const auto stopped = in.records<std::uint64_t>(1, in.limits().maxIds);
    out.stopped.reserve(stopped.size());
    for (const std::uint64_t id : stopped) out.stopped.emplace_back(id);
    return out;
}

answer::Status unpackStatus(const pb::Status& head, Unpacker& in) {
    in.expectParts(0);
    answer::Status out;
    out.wallName = in.text(head.wall_name());
    out.epoch = head.epoch();
    out.frame = head.frame();
    out.sequence = head.sequence();
    out.stateHash = head.state_hash();
    if (in.within(static_cast<std::size_t>(head.hosts_size()), in.limits().maxHosts, "hosts"))
        for (const pb::HostInfo& host : head.hosts())
            out.hosts.push_back(
                {in.text(host.name()), in.text(host.state()), host.last_shown(), in.finite(host.round_trip_ms())});
    out.waitingFor = in.texts(head.waiting_for(), in.limits().maxHosts);
    out.objects = head.objects();
    out.nodes = head.nodes();
    out.undoDepth = head.undo_depth();
    out.applications = head.applications();
    return out;
}

answer::Images unpackImages(const pb::Images& head, Unpacker& in) {
    answer::Images out;
    const auto count = static_cast<std::size_t>(head.tiles_size());
    in.expectParts(count);
    for (std::size_t i = 0; i < count; ++i) {
        const pb::TileImage& image = head.tiles(static_cast<int>(i));
        out.tiles.push_back({in.text(image.tile()), in.text(image.host()), image.frame(), copyOf(in.part(i))});
    }
    out.missing = in.texts(head.missing(), in.limits().maxTiles);
    return out;
}

ApplicationAnswer unpackAnswer(const pb::AnswerHead& head, Unpacker& in) {
    switch (head.what_case()) {
        case pb::AnswerHead::kDone:
            in.expectParts(0);
            return answer::Done{};
        case pb::AnswerHead::kCommitted:
            return unpackCommitted(head.committed(), in);
        case pb::AnswerHead::kStatus:
            return unpackStatus(head.status(), in);
        case pb::AnswerHead::kLoaded:
            in.expectParts(0);
            return answer::Loaded{ObjectId{head.loaded().node()}, head.loaded().objects(), head.loaded().triangles()};
        case pb::AnswerHead::kPicked:
            in.expectParts(0);
            return in.picked(head.picked());
        case pb::AnswerHead::kContacts:
            return in.contacts(head.contacts());
        case pb::AnswerHead::kImages:
            return unpackImages(head.images(), in);
        case pb::AnswerHead::WHAT_NOT_SET:
            break;
    }
    in.refuse(ErrorCode::kUnsupported, "it says something that this version does not know");
    return answer::Done{};
}

// ---- notices

Bytes join(const notice::Frame& n, pb::NoticeHead& head) {
    head.mutable_frame()->set_frame(n.frame);
    for (const std::string& name : n.shown) head.mutable_frame()->add_shown(name);
    for (const std::string& name : n.held) head.mutable_frame()->add_held(name);
    return joinParts(head, {});
}
Bytes join(const answer::Contacts& n, pb::NoticeHead& head) {
    std::vector<ContactRecord> records;
    put(head.mutable_contacts(), n, records);
    return joinParts(head, std::array{recordBytes(records)});
}
Bytes join(const answer::Picked& n, pb::NoticeHead& head) {
    put(head.mutable_picked(), n);
    return joinParts(head, {});
}

ApplicationNotice unpackNotice(const pb::NoticeHead& head, Unpacker& in) {
    switch (head.what_case()) {
        case pb::NoticeHead::kFrame:
            in.expectParts(0);
            return notice::Frame{head.frame().frame(), in.texts(head.frame().shown(), in.limits().maxHosts),
                                 in.texts(head.frame().held(), in.limits().maxHosts)};
        case pb::NoticeHead::kContacts:
            return in.contacts(head.contacts());
        case pb::NoticeHead::kPicked:
            in.expectParts(0);
            return in.picked(head.picked());
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

Expected<ApplicationRequest> decodeRequest(ByteSpan bytes, const ApplicationLimits& limits) {
    return decode<pb::RequestHead>(bytes, "request", limits.maxBlobs + 1, limits, unpackRequest);
}

Bytes encodeAnswer(const ApplicationAnswer& answer) {
    pb::AnswerHead head;
    return std::visit([&](const auto& a) { return join(a, head); }, answer);
}

Expected<ApplicationAnswer> decodeAnswer(ByteSpan bytes, const ApplicationLimits& limits) {
    return decode<pb::AnswerHead>(bytes, "answer", limits.maxTiles, limits, unpackAnswer);
}

Bytes encodeNotice(const ApplicationNotice& notice) {
    pb::NoticeHead head;
    return std::visit([&](const auto& n) { return join(n, head); }, notice);
}

Expected<ApplicationNotice> decodeNotice(ByteSpan bytes, const ApplicationLimits& limits) {
    return decode<pb::NoticeHead>(bytes, "notice", 1, limits, unpackNotice);
}

}  // namespace tessera
