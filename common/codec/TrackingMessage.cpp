#include "common/codec/TrackingMessage.h"

#include <fmt/format.h>

#include <algorithm>

#include "proto/wall.pb.h"

namespace tessera {

namespace {

void putRigid(proto::Wall::Rigid& to, const Vec3d& position, const Quatd& orientation) {
    to.mutable_position()->set_x(position.x());
    to.mutable_position()->set_y(position.y());
    to.mutable_position()->set_z(position.z());
    to.mutable_orientation()->set_w(orientation.w());
    to.mutable_orientation()->set_x(orientation.x());
    to.mutable_orientation()->set_y(orientation.y());
    to.mutable_orientation()->set_z(orientation.z());
}
void readRigid(const proto::Wall::Rigid& from, Vec3d& position, Quatd& orientation) {
    position = {from.position().x(), from.position().y(), from.position().z()};
    if (!from.has_orientation()) return;
    const proto::Wall::Quaternion& q = from.orientation();
    orientation = Quatd(q.w(), q.x(), q.y(), q.z());
}

void putMount(proto::Wall::Mount& to, const TrackedMount& mount) {
    to.set_tracker(mount.tracker);
    switch (mount.sensor.kind) {
        case SensorKind::kBody:
            to.set_sensor(mount.sensor.number);
            break;
        case SensorKind::kFlystick:
            to.set_flystick(mount.sensor.number);
            break;
        case SensorKind::kTool:
            to.set_tool(mount.sensor.number);
            break;
        case SensorKind::kMarker:
            to.set_marker(mount.sensor.number);
            break;
    }
    putRigid(*to.mutable_offset(), mount.offset, mount.turn);
}
TrackedMount readMount(const proto::Wall::Mount& from) {
    TrackedMount mount;
    mount.tracker = from.tracker();
    switch (from.which_case()) {
        case proto::Wall::Mount::kFlystick:
            mount.sensor = {SensorKind::kFlystick, from.flystick()};
            break;
        case proto::Wall::Mount::kTool:
            mount.sensor = {SensorKind::kTool, from.tool()};
            break;
        case proto::Wall::Mount::kMarker:
            mount.sensor = {SensorKind::kMarker, from.marker()};
            break;
        case proto::Wall::Mount::kSensor:
            mount.sensor = {SensorKind::kBody, from.sensor()};
            break;
        case proto::Wall::Mount::WHICH_NOT_SET:
            break;
    }
    readRigid(from.offset(), mount.offset, mount.turn);
    return mount;
}

void putFilter(proto::Wall::Filter& to, const TrackerFilter& filter) {
    to.set_enabled(filter.enabled);
    to.set_jitter_mm(filter.jitterMillimetres);
    to.set_jitter_degrees(filter.jitterDegrees);
    to.set_predict_ms(filter.longestPrediction.count());
    to.set_jump_m(filter.jumpMetres);
    to.set_hold_ms(filter.holdFor.count());
    to.set_ease_ms(filter.easeFor.count());
}
TrackerFilter readFilter(const proto::Wall::Filter& from) {
    const auto ms = [](std::int64_t value) { return std::chrono::milliseconds(value); };
    TrackerFilter filter;
    if (from.has_enabled()) filter.enabled = from.enabled();
    if (from.has_jitter_mm()) filter.jitterMillimetres = from.jitter_mm();
    if (from.has_jitter_degrees()) filter.jitterDegrees = from.jitter_degrees();
    if (from.has_predict_ms()) filter.longestPrediction = ms(from.predict_ms());
    if (from.has_jump_m()) filter.jumpMetres = from.jump_m();
    if (from.has_hold_ms()) filter.holdFor = ms(from.hold_ms());
    if (from.has_ease_ms()) filter.easeFor = ms(from.ease_ms());
    return filter;
}

void putTracker(proto::Wall::Tracker& to, const WallTracker& tracker) {
    to.set_name(tracker.name);
    switch (tracker.protocol) {
        case TrackerProtocol::kDtrack:
            to.mutable_dtrack()->set_listen(tracker.address);
            break;
        case TrackerProtocol::kOsc:
            to.mutable_osc()->set_listen(tracker.address);
            break;
        case TrackerProtocol::kVrpn:
            to.mutable_vrpn()->set_url(tracker.address);
            to.mutable_vrpn()->set_buttons(tracker.buttonDevice);
            to.mutable_vrpn()->set_analogs(tracker.analogDevice);
            break;
    }
    putRigid(*to.mutable_frame(), tracker.position, tracker.orientation);
    to.set_scale(tracker.metresPerUnit);
    to.set_axes(tracker.axes);
    for (const std::string& allowed : tracker.allowFrom) to.add_allow_from(allowed);
    putFilter(*to.mutable_filter(), tracker.filter);
}

/// Nothing where it does not say what the device speaks.
std::optional<WallTracker> readTracker(const proto::Wall::Tracker& from) {
    WallTracker tracker;
    tracker.name = from.name();
    switch (from.protocol_case()) {
        case proto::Wall::Tracker::kDtrack:
            tracker.address = from.dtrack().listen();
            break;
        case proto::Wall::Tracker::kOsc:
            tracker.protocol = TrackerProtocol::kOsc;
            tracker.address = from.osc().listen();
            break;
        case proto::Wall::Tracker::kVrpn:
            tracker.protocol = TrackerProtocol::kVrpn;
            tracker.address = from.vrpn().url();
            tracker.buttonDevice = from.vrpn().buttons();
            tracker.analogDevice = from.vrpn().analogs();
            break;
        case proto::Wall::Tracker::PROTOCOL_NOT_SET:
            return std::nullopt;
    }
    readRigid(from.frame(), tracker.position, tracker.orientation);
    tracker.metresPerUnit = from.scale();
    if (!from.axes().empty()) tracker.axes = from.axes();
    tracker.allowFrom.assign(from.allow_from().begin(), from.allow_from().end());
    tracker.filter = readFilter(from.filter());
    return tracker;
}

}  // namespace

void putTracking(const Wall& wall, proto::Wall& message) {
    for (const WallTracker& tracker : wall.tracking.trackers) putTracker(*message.add_trackers(), tracker);
    for (const WallHead& head : wall.tracking.heads)
        for (int i = 0; i < message.users_size(); ++i)
            if (message.users(i).name() == head.user) putMount(*message.mutable_users(i)->mutable_head(), head.mount);
    for (const WallWand& wand : wall.tracking.wands) {
        proto::Wall::Wand& to = *message.add_wands();
        to.set_name(wand.name);
        putMount(*to.mutable_mount(), wand.mount);
    }
}

std::optional<WallFault> readTracking(const proto::Wall& message, Wall& wall) {
    for (int i = 0; i < message.trackers_size(); ++i) {
        std::optional<WallTracker> tracker = readTracker(message.trackers(i));
        if (!tracker)
            return WallFault{
                .part = WallFault::Part::kTracker,
                .index = static_cast<std::size_t>(i),
                .tile = 0,
                .message = fmt::format("tracker \"{}\" does not say what it speaks: add `dtrack {{ listen: "
                                       "\"0.0.0.0:5000\" }}`, `osc {{ … }}` or `vrpn {{ url: … }}`",
                                       message.trackers(i).name())};
        wall.tracking.trackers.push_back(std::move(*tracker));
    }
    for (const proto::Wall::User& user : message.users())
        if (user.has_head()) wall.tracking.heads.push_back({.user = user.name(), .mount = readMount(user.head())});
    for (const proto::Wall::Wand& wand : message.wands())
        wall.tracking.wands.push_back({.name = wand.name(), .mount = readMount(wand.mount())});
    return std::nullopt;
}

}  // namespace tessera
