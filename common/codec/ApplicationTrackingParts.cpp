#include "common/codec/ApplicationTrackingParts.h"

#include "common/codec/ApplicationUnpacker.h"
#include "proto/application.pb.h"

namespace tessera {

namespace {

namespace wire = proto::application;

constexpr std::size_t kMostTrackersTold = 64, kMostSensorsTold = 1024, kMostPosesTold = 1024, kMostAxesTold = 64;

void putVector(wire::Vector& to, const Vec3d& v) {
    to.set_x(v.x());
    to.set_y(v.y());
    to.set_z(v.z());
}
void putRotation(wire::Rotation& to, const Quatd& q) {
    to.set_w(q.w());
    to.set_x(q.x());
    to.set_y(q.y());
    to.set_z(q.z());
}

template <typename Repeated>
bool fits(const Repeated& values, std::size_t most, std::string_view what, ApplicationUnpacker& in) {
    return in.within(static_cast<std::size_t>(values.size()), most, what);
}

}  // namespace

void putTrackers(wire::Trackers& to, const answer::Trackers& from) {
    for (const TrackerInfo& tracker : from.trackers) {
        wire::TrackerInfo& out = *to.add_trackers();
        out.set_name(tracker.name);
        out.set_protocol(tracker.protocol);
        out.set_address(tracker.address);
        out.set_trouble(tracker.trouble);
        out.set_datagrams(tracker.datagrams);
        out.set_strangers(tracker.strangers);
        out.set_malformed(tracker.malformed);
        out.set_too_many(tracker.tooMany);
        for (const SensorInfo& sensor : tracker.sensors) {
            wire::SensorInfo& info = *out.add_sensors();
            info.set_sensor(sensor.sensor);
            info.set_moves(sensor.moves);
            info.set_poses(sensor.poses);
            info.set_refused(sensor.refused);
            info.set_rate_hz(sensor.rateHz);
            info.set_age_ms(sensor.ageMs);
            info.set_strays_mm(sensor.straysMm);
            info.set_buttons(sensor.buttons);
        }
    }
}

answer::Trackers readTrackers(const wire::Trackers& from, ApplicationUnpacker& in) {
    answer::Trackers out;
    if (!fits(from.trackers(), kMostTrackersTold, "trackers", in)) return out;
    for (const wire::TrackerInfo& tracker : from.trackers()) {
        if (!fits(tracker.sensors(), kMostSensorsTold, "sensors", in)) return out;
        TrackerInfo info{.name = in.text(tracker.name()),
                         .protocol = in.text(tracker.protocol()),
                         .address = in.text(tracker.address()),
                         .trouble = in.text(tracker.trouble()),
                         .datagrams = tracker.datagrams(),
                         .strangers = tracker.strangers(),
                         .malformed = tracker.malformed(),
                         .tooMany = tracker.too_many(),
                         .sensors = {}};
        for (const wire::SensorInfo& sensor : tracker.sensors())
            info.sensors.push_back({.sensor = in.text(sensor.sensor()),
                                    .moves = in.text(sensor.moves()),
                                    .poses = sensor.poses(),
                                    .refused = sensor.refused(),
                                    .rateHz = in.finite(sensor.rate_hz()),
                                    .ageMs = in.finite(sensor.age_ms()),
                                    .straysMm = in.finite(sensor.strays_mm()),
                                    .buttons = sensor.buttons()});
        out.trackers.push_back(std::move(info));
    }
    return out;
}

void putPoses(wire::Poses& to, const notice::Poses& from) {
    to.set_frame(from.frame.value);
    for (const HeadState& head : from.heads) {
        wire::HeadState& out = *to.add_heads();
        out.set_user(head.user);
        out.set_tracked(head.tracked);
        out.set_poses(head.poses);
        putVector(*out.mutable_position(), head.position);
        putRotation(*out.mutable_orientation(), head.orientation);
    }
    for (const WandState& wand : from.wands) {
        wire::WandState& out = *to.add_wands();
        out.set_name(wand.name);
        out.set_tracked(wand.tracked);
        out.set_poses(wand.poses);
        putVector(*out.mutable_position(), wand.position);
        putRotation(*out.mutable_orientation(), wand.orientation);
        putVector(*out.mutable_world_position(), wand.worldPosition);
        putRotation(*out.mutable_world_orientation(), wand.worldOrientation);
        out.set_buttons(wand.buttons);
        for (const double axis : wand.axes) out.add_axes(axis);
    }
}

notice::Poses readPoses(const wire::Poses& from, ApplicationUnpacker& in) {
    notice::Poses out;
    out.frame = FrameNumber(from.frame());
    if (!fits(from.heads(), kMostPosesTold, "heads", in) || !fits(from.wands(), kMostPosesTold, "wands", in))
        return out;
    for (const wire::HeadState& head : from.heads())
        out.heads.push_back({.user = in.text(head.user()),
                             .tracked = head.tracked(),
                             .poses = head.poses(),
                             .position = in.vector(head.position()),
                             .orientation = in.rotation(head.orientation())});
    for (const wire::WandState& wand : from.wands()) {
        if (!fits(wand.axes(), kMostAxesTold, "axes", in)) return out;
        WandState state{.name = in.text(wand.name()),
                        .tracked = wand.tracked(),
                        .poses = wand.poses(),
                        .position = in.vector(wand.position()),
                        .orientation = in.rotation(wand.orientation()),
                        .worldPosition = in.vector(wand.world_position()),
                        .worldOrientation = in.rotation(wand.world_orientation()),
                        .buttons = wand.buttons(),
                        .axes = {}};
        for (const double axis : wand.axes()) state.axes.push_back(in.finite(axis));
        out.wands.push_back(std::move(state));
    }
    return out;
}

}  // namespace tessera
