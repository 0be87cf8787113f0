#include "common/codec/FrameCodec.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "common/codec/Parts.h"
#include "common/wall/Detail.h"
#include "proto/frame.pb.h"

namespace tessera {

namespace {

// Far above any wall, far below what would hurt.
constexpr std::size_t kMaxUsers = 64;
constexpr std::size_t kMaxTiles = 1024;
constexpr std::size_t kMaxHeldUp = 1024;
constexpr std::size_t kMaxNameBytes = 256;
constexpr std::size_t kMaxFrameHeadBytes = std::size_t{512} << 10;

tl::unexpected<Error> badFrame(std::string what) {
    return fail(ErrorCode::kBadInput, std::move(what));
}

void write(proto::frame::Vector& to, const Vec3d& v) {
    to.set_x(v.x());
    to.set_y(v.y());
    to.set_z(v.z());
}
void write(proto::frame::Rotation& to, const Quatd& q) {
    to.set_w(q.w());
    to.set_x(q.x());
    to.set_y(q.y());
    to.set_z(q.z());
}

Expected<Vec3d> readPosition(const proto::frame::Vector& from) {
    const Vec3d v(from.x(), from.y(), from.z());
    if (!v.allFinite()) return badFrame("frame: a position is not finite");
    return v;
}
Expected<Quatd> readRotation(const proto::frame::Rotation& from) {
    const Quatd q(from.w(), from.x(), from.y(), from.z());
    const double squared = q.squaredNorm();
    if (!(squared > 1e-100 && squared < 1e100)) return badFrame("frame: an orientation cannot be normalised");
    return q;
}

Expected<User> readUser(const proto::frame::User& from) {
    if (from.name().size() > kMaxNameBytes)
        return badFrame(fmt::format("frame: a user's name of {} bytes", from.name().size()));
    const auto position = readPosition(from.position());
    if (!position) return tl::unexpected(position.error());
    const auto orientation = readRotation(from.orientation());
    if (!orientation) return tl::unexpected(orientation.error());
    if (!std::isfinite(from.eye_separation_metres())) return badFrame("frame: an eye separation is not finite");
    User user;
    user.name = from.name();
    user.position = *position;
    user.orientation = *orientation;
    user.eyeSeparationMetres = from.eye_separation_metres();
    return user;
}

void write(proto::frame::Collision& to, const FrameCollision& collision) {
    to.set_contacts(collision.contacts);
    to.set_begun(collision.begun);
    to.set_ended(collision.ended);
    to.set_near(collision.near);
    to.set_nearest(collision.nearest);
}
Expected<FrameCollision> readCollision(const proto::frame::Collision& from) {
    if (!(from.nearest() >= 0) || !std::isfinite(from.nearest())) return badFrame("frame: a distance that is none");
    return FrameCollision{.contacts = from.contacts(),
                          .begun = from.begun(),
                          .ended = from.ended(),
                          .near = from.near(),
                          .nearest = from.nearest()};
}

void write(proto::frame::Exposure& to, const Exposure& exposure) {
    if (exposure.wish.stops) to.set_stops(*exposure.wish.stops);
    if (exposure.wish.metered) to.set_metered(*exposure.wish.metered);
    if (exposure.wish.toneMap) to.set_tone_map(static_cast<std::uint32_t>(*exposure.wish.toneMap));
    to.set_found(exposure.found);
}
Expected<Exposure> readExposure(const proto::frame::Exposure& from) {
    Exposure exposure{.wish = {}, .found = from.found()};
    if (std::abs(exposure.foundStops()) > kMostStops)
        return badFrame(fmt::format("frame: an exposure of {} stops", exposure.foundStops()));
    if (from.has_stops()) {
        if (!(std::abs(from.stops()) <= kMostStops)) return badFrame("frame: an exposure that is none");
        exposure.wish.stops = from.stops();
    }
    if (from.has_metered()) exposure.wish.metered = from.metered();
    if (from.has_tone_map()) {
        if (from.tone_map() > static_cast<std::uint32_t>(kLastToneMap))
            return badFrame(fmt::format("frame: tone map {}, which nobody knows", from.tone_map()));
        exposure.wish.toneMap = static_cast<ToneMap>(from.tone_map());
    }
    return exposure;
}

}  // namespace

Bytes encodeFrame(const FramePayload& payload) {
    proto::frame::FrameHead head;
    write(*head.mutable_position(), payload.view.position);
    write(*head.mutable_orientation(), payload.view.orientation);
    head.set_world_units_per_metre(payload.view.worldUnitsPerMetre);
    for (const User& user : payload.view.users) {
        proto::frame::User& to = *head.add_users();
        to.set_name(user.name);
        write(*to.mutable_position(), user.position);
        write(*to.mutable_orientation(), user.orientation);
        to.set_eye_separation_metres(user.eyeSeparationMetres);
    }
    if (payload.collision != FrameCollision()) write(*head.mutable_collision(), payload.collision);
    head.set_showing(static_cast<std::uint32_t>(payload.showing));
    head.set_detail(payload.view.detail);
    if (payload.view.studio) {
        write(*head.mutable_studio()->mutable_middle(), payload.view.studio->middle);
        head.mutable_studio()->set_reach(payload.view.studio->reach);
    }
    if (payload.view.exposure != Exposure()) write(*head.mutable_exposure(), payload.view.exposure);
    return joinParts(head, {});
}

Expected<FramePayload> decodeFrame(ByteSpan bytes) {
    const auto split = splitParts(bytes, kMaxFrameHeadBytes, 0);
    if (!split) return failWith("frame", split.error());
    proto::frame::FrameHead head;
    if (!head.ParseFromArray(split->head.data(), static_cast<int>(split->head.size())))
        return badFrame("frame: its head is damaged");
    if (static_cast<std::size_t>(head.users_size()) > kMaxUsers)
        return badFrame(fmt::format("frame: {} users", head.users_size()));

    FramePayload payload;
    const auto position = readPosition(head.position());
    if (!position) return tl::unexpected(position.error());
    payload.view.position = *position;
    const auto orientation = readRotation(head.orientation());
    if (!orientation) return tl::unexpected(orientation.error());
    payload.view.orientation = *orientation;
    if (!(head.world_units_per_metre() > 0) || !std::isfinite(head.world_units_per_metre()))
        return badFrame("frame: the scale of the wall is not a positive number");
    payload.view.worldUnitsPerMetre = head.world_units_per_metre();
    for (const proto::frame::User& from : head.users()) {
        auto user = readUser(from);
        if (!user) return tl::unexpected(user.error());
        payload.view.users.push_back(std::move(*user));
    }
    const auto collision = readCollision(head.collision());
    if (!collision) return tl::unexpected(collision.error());
    payload.collision = *collision;
    if (head.showing() > kLastShowing)
        return badFrame(fmt::format("frame: it shows {}, which nobody knows", head.showing()));
    payload.showing = static_cast<Showing>(head.showing());
    if (head.detail() >= kDetailSteps.size())
        return badFrame(fmt::format("frame: step {} of detail, of {}", head.detail(), kDetailSteps.size()));
    payload.view.detail = head.detail();
    if (head.has_studio()) {
        const auto middle = readPosition(head.studio().middle());
        if (!middle) return tl::unexpected(middle.error());
        if (!(head.studio().reach() > 0) || !std::isfinite(head.studio().reach()))
            return badFrame("frame: the reach of its studio is not a positive number");
        payload.view.studio = Studio{.middle = *middle, .reach = head.studio().reach()};
    }
    const auto exposure = readExposure(head.exposure());
    if (!exposure) return tl::unexpected(exposure.error());
    payload.view.exposure = *exposure;
    return payload;
}

Bytes encodeStats(const HostStats& stats) {
    proto::frame::StatsHead head;
    head.set_work_ms(stats.workMs);
    head.set_apply_ms(stats.applyMs);
    head.set_apply_queued_ms(stats.applyQueuedMs);
    head.set_helped_parts(stats.helpedParts);
    head.set_help_ms(stats.helpMs);
    for (const HeldUp& held : stats.heldUp) {
        proto::frame::HeldUp& to = *head.add_held_up();
        to.set_program(held.program.value);
        to.set_ms(held.ms);
    }
    for (const TileStats& tile : stats.tiles) {
        proto::frame::TileStats& to = *head.add_tiles();
        to.set_tile(tile.tile);
        to.set_cull_ms(tile.cullMs);
        to.set_draw_ms(tile.drawMs);
        to.set_in_frustum(tile.inFrustum);
        to.set_drawn(tile.drawn);
        to.set_triangles_drawn(tile.trianglesDrawn);
        to.set_queries(tile.queries);
        to.set_waits(tile.waits);
        to.set_depth_triangles(tile.depthTriangles);
        to.set_hand_over_ms(tile.handOverMs);
        to.set_cull_queued_ms(tile.cullQueuedMs);
        to.set_draw_queued_ms(tile.drawQueuedMs);
        to.set_parts(tile.parts);
        to.set_parts_helped(tile.partsHelped);
        to.set_parts_twice(tile.partsTwice);
    }
    if (stats.light)
        head.mutable_light()->mutable_pixels()->Add(stats.light->pixels.begin(), stats.light->pixels.end());
    return joinParts(head, {});
}

Expected<HostStats> decodeStats(ByteSpan bytes) {
    const auto split = splitParts(bytes, kMaxFrameHeadBytes, 0);
    if (!split) return failWith("statistics", split.error());
    proto::frame::StatsHead head;
    if (!head.ParseFromArray(split->head.data(), static_cast<int>(split->head.size())))
        return badFrame("statistics: their head is damaged");
    if (static_cast<std::size_t>(head.tiles_size()) > kMaxTiles)
        return badFrame(fmt::format("statistics: {} tiles", head.tiles_size()));
    // They end up in a report: NaN would make it unreadable, as would sums that are no number any more.
    const auto areTimes = [](std::initializer_list<double> times) {
        constexpr double kLongestMs = 1e12;
        return std::ranges::all_of(times, [](double ms) { return ms >= 0 && ms <= kLongestMs; });
    };
    const auto noTime = [] { return badFrame("statistics: a time is not a number of milliseconds"); };
    if (!areTimes({head.work_ms(), head.apply_ms(), head.apply_queued_ms(), head.help_ms()})) return noTime();
    HostStats stats{.tiles = {},
                    .workMs = head.work_ms(),
                    .applyMs = head.apply_ms(),
                    .applyQueuedMs = head.apply_queued_ms(),
                    .helpedParts = head.helped_parts(),
                    .helpMs = head.help_ms()};
    if (static_cast<std::size_t>(head.held_up_size()) > kMaxHeldUp)
        return badFrame(fmt::format("statistics: {} programs that hold it up", head.held_up_size()));
    for (const proto::frame::HeldUp& from : head.held_up()) {
        if (!areTimes({from.ms()})) return noTime();
        stats.heldUp.push_back({ObjectId(from.program()), from.ms()});
    }
    for (const proto::frame::TileStats& from : head.tiles()) {
        if (from.tile().size() > kMaxNameBytes)
            return badFrame(fmt::format("statistics: a tile's name of {} bytes", from.tile().size()));
        if (!areTimes(
                {from.cull_ms(), from.draw_ms(), from.hand_over_ms(), from.cull_queued_ms(), from.draw_queued_ms()}))
            return noTime();
        stats.tiles.push_back({.tile = from.tile(),
                               .cullMs = from.cull_ms(),
                               .drawMs = from.draw_ms(),
                               .inFrustum = from.in_frustum(),
                               .drawn = from.drawn(),
                               .trianglesDrawn = from.triangles_drawn(),
                               .queries = from.queries(),
                               .waits = from.waits(),
                               .depthTriangles = from.depth_triangles(),
                               .handOverMs = from.hand_over_ms(),
                               .cullQueuedMs = from.cull_queued_ms(),
                               .drawQueuedMs = from.draw_queued_ms(),
                               .parts = from.parts(),
                               .partsHelped = from.parts_helped(),
                               .partsTwice = from.parts_twice()});
    }
    if (head.has_light()) {
        if (head.light().pixels_size() != LightHistogram::kClasses)
            return badFrame(fmt::format("statistics: {} classes of brightness", head.light().pixels_size()));
        std::ranges::copy(head.light().pixels(), stats.light.emplace().pixels.begin());
    }
    return stats;
}

}  // namespace tessera
