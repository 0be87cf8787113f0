#include "server/sim/tracking/Tracking.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace tessera {

namespace {

/// The rigid pose of something mounted on a sensor.
RigidPose mounted(const RigidPose& sensor, const TrackedMount& mount) {
    return {.position = sensor.position + sensor.orientation * mount.offset,
            .orientation = (sensor.orientation * mount.turn.normalized()).normalized()};
}

}  // namespace

void Tracking::Controls::take(const SensorReport& report) {
    buttons = (buttons & ~report.buttonsSaid) | (report.buttons & report.buttonsSaid);
    for (int axis = 0; axis < kMostAxes; ++axis) {
        if ((report.axesSaid >> axis & 1) == 0) continue;
        const double value = report.axes[static_cast<std::size_t>(axis)];
        // A stick that says no number does not go on with the one before.
        axes[static_cast<std::size_t>(axis)] = std::isfinite(value) ? std::clamp(value, -1e6, 1e6) : 0;
        axisCount = std::max(axisCount, axis + 1);
    }
}

void Tracking::Controls::forget() {
    buttons = 0;
    axes.fill(0);
}

Tracking::Tracking(const Wall& wall) {
    for (const WallTracker& setup : wall.tracking.trackers) {
        const Expected<Mat3d> axes = parseAxes(setup.axes);
        TESSERA_CHECK(axes.has_value(), "a tracker's axes are no frame: checkWall was not called");
        trackers_.push_back({.setup = setup, .axes = *axes, .sensors = {}});
    }
    for (const WallHead& head : wall.tracking.heads) {
        headFollowers_.push_back(follower("head " + head.user, head.mount));
        heads_.push_back({.user = head.user});
    }
    for (const WallWand& wand : wall.tracking.wands) {
        Follower& hand = wandFollowers_.emplace_back(follower("wand " + wand.name, wand.mount));
        // VRPN's buttons are the device's, told as body 0's.
        const bool shared = trackers_[hand.tracker].setup.protocol == TrackerProtocol::kVrpn;
        hand.hand = shared ? SensorName{} : wand.mount.sensor;
        wands_.push_back({.name = wand.name});
    }
    for (const auto* all : {&headFollowers_, &wandFollowers_})
        for (const Follower& one : *all) {
            Tracker& tracker = trackers_[one.tracker];
            tracker.sensors.try_emplace(one.mount.sensor, tracker.setup.filter);
        }
}

Tracking::Follower Tracking::follower(std::string what, const TrackedMount& mount) const {
    const auto found =
        std::ranges::find_if(trackers_, [&](const Tracker& tracker) { return tracker.setup.name == mount.tracker; });
    TESSERA_CHECK(found != trackers_.end(),
                  "a head follows a tracker that its wall does not have: checkWall was not called");
    return {.what = std::move(what), .tracker = static_cast<std::size_t>(found - trackers_.begin()), .mount = mount};
}

const Tracking::Sensor* Tracking::sensorOf(const Follower& follower) const {
    return &trackers_[follower.tracker].sensors.at(follower.mount.sensor);
}

RawPose Tracking::inWall(const Tracker& tracker, const RawPose& raw) const {
    const Quatd frame = tracker.setup.orientation.normalized();
    RawPose pose = raw;
    pose.position = tracker.setup.position + frame * (tracker.setup.metresPerOwnUnit() * (tracker.axes * raw.position));
    if (!raw.turns) {
        pose.orientation = Quatd::Identity();
        return pose;
    }
    // R' = A R A⁻¹ is a rotation even where A mirrors. Of a quaternion: its axis goes with A, its sense with A's
    // determinant.
    const Vec3d axis = tracker.axes.determinant() * (tracker.axes * raw.orientation.vec());
    pose.orientation = frame * Quatd(raw.orientation.w(), axis.x(), axis.y(), axis.z());
    return pose;
}

void Tracking::takeControls(std::size_t tracker, const SensorReport& report, TimePoint at) {
    for (Follower& wand : wandFollowers_) {
        if (wand.tracker != tracker) continue;
        const bool says = report.sensor == wand.hand && (report.buttonsSaid | report.axesSaid) != 0;
        const bool moves = report.sensor == wand.mount.sensor;
        if (!says && !moves) continue;
        // It may have been lost, and back, between two frames.
        const PoseFilter& filter = sensorOf(wand)->filter;
        const Duration hold = trackers_[tracker].setup.filter.holdFor;
        const bool back =
            report.pose && moves && wand.state == Follower::State::kThere && filter.any() && at - filter.last() > hold;
        if (back || at - wand.heard > kControlsCount) wand.controls.forget();
        wand.heard = std::max(wand.heard, at);
        if (says) wand.controls.take(report);
    }
}

void Tracking::take(const TrackerReading& reading) {
    Tracker& tracker = trackers_.at(reading.tracker);
    if (reading.connectionEnded) {
        for (auto& [name, sensor] : tracker.sensors) sensor.buttons = 0;
        for (Follower& wand : wandFollowers_)
            if (wand.tracker == reading.tracker) wand.controls.forget();
    }
    for (const SensorReport& report : reading.reports) {
        tracker.heard = reading.at;
        takeControls(reading.tracker, report, reading.at);
        auto found = tracker.sensors.find(report.sensor);
        if (found == tracker.sensors.end()) {
            if (tracker.sensors.size() >= kMaxSensors) continue;
            found = tracker.sensors.try_emplace(report.sensor, tracker.setup.filter).first;
        }
        Sensor& sensor = found->second;
        sensor.buttons = (sensor.buttons & ~report.buttonsSaid) | (report.buttons & report.buttonsSaid);
        if (!report.pose) continue;
        const bool known = sensor.filter.any();
        const TimePoint before = known ? sensor.filter.last() : TimePoint{};
        const TimePoint at = known ? std::max(before, reading.at) : reading.at;
        if (sensor.filter.add(at, inWall(tracker, *report.pose)) != PoseFilter::Verdict::kTaken) {
            ++sensor.refused;
            continue;
        }
        ++sensor.poses;
        if (!known) {
            sensor.windowBegan = at;
            continue;
        }
        ++sensor.inWindow;
        if (at - sensor.windowBegan < kRateWindow) continue;
        sensor.interval =
            std::chrono::duration<double>(at - sensor.windowBegan).count() / static_cast<double>(sensor.inWindow);
        sensor.windowBegan = at;
        sensor.inWindow = 0;
    }
}

double Tracking::shareOf(Follower& follower, TimePoint now, std::vector<std::string>& said) const {
    using State = Follower::State;
    const Sensor& sensor = *sensorOf(follower);
    if (!sensor.filter.any()) return 0;
    const TrackerFilter& settings = trackers_[follower.tracker].setup.filter;
    const Duration silent = now - sensor.filter.last();
    const bool gone = silent > settings.holdFor;
    if (gone && follower.state == State::kThere)
        said.push_back(fmt::format("tracker {} has said nothing of {} for {:.1f} s: {} {}", follower.mount.tracker,
                                   toString(follower.mount.sensor), std::chrono::duration<double>(silent).count(),
                                   follower.what,
                                   follower.what.starts_with("head") ? "goes back to where it stands without a tracker"
                                                                     : "is not tracked any more"));
    if (!gone && follower.state != State::kThere)
        said.push_back(fmt::format("tracker {} {} of {}: {} follows", follower.mount.tracker,
                                   follower.state == State::kNever ? "speaks" : "speaks again",
                                   toString(follower.mount.sensor), follower.what));
    follower.state = gone ? State::kGone : State::kThere;
    if (!gone) return 1;
    if (settings.easeFor.count() == 0) return 0;
    const double done = std::clamp(
        std::chrono::duration<double>(silent - settings.holdFor) / std::chrono::duration<double>(settings.easeFor), 0.0,
        1.0);
    return 1 - done * done * (3 - 2 * done);
}

std::vector<std::string> Tracking::advance(TimePoint now, TimePoint shown) {
    std::vector<std::string> said;
    for (std::size_t i = 0; i < heads_.size(); ++i) {
        TrackedHead& head = heads_[i];
        const Sensor& sensor = *sensorOf(headFollowers_[i]);
        head.share = shareOf(headFollowers_[i], now, said);
        head.poses = sensor.poses;
        if (head.share == 0) continue;
        const RigidPose pose = mounted(sensor.filter.at(shown), headFollowers_[i].mount);
        head.position = pose.position;
        head.orientation = pose.orientation;
    }
    for (std::size_t i = 0; i < wands_.size(); ++i) {
        WandState& wand = wands_[i];
        Follower& hand = wandFollowers_[i];
        const Sensor& sensor = *sensorOf(hand);
        const bool wasThere = hand.state == Follower::State::kThere;
        wand.tracked = shareOf(hand, now, said) == 1;
        if (wasThere && !wand.tracked) hand.controls.forget();
        wand.poses = sensor.poses;
        // For good: what a wand that speaks again does not say, nobody knows any more.
        if (now - hand.heard > kControlsCount) hand.controls.forget();
        wand.buttons = hand.controls.buttons;
        wand.axes.assign(hand.controls.axes.begin(), hand.controls.axes.begin() + hand.controls.axisCount);
        if (!sensor.filter.any()) continue;
        const RigidPose pose = mounted(sensor.filter.at(shown), wandFollowers_[i].mount);
        wand.position = pose.position;
        wand.orientation = pose.orientation;
    }
    return said;
}

notice::Poses Tracking::poses(FrameNumber frame, const View& view) const {
    notice::Poses told{.frame = frame, .heads = {}, .wands = wands_};
    for (const User& user : view.users) {
        const auto head = std::ranges::find(heads_, user.name, &TrackedHead::user);
        const bool known = head != heads_.end();
        told.heads.push_back({.user = user.name,
                              .tracked = known && head->share == 1,
                              .poses = known ? head->poses : 0,
                              .position = user.position,
                              .orientation = user.orientation});
    }
    const Affine3d world_T_wall = view.world_T_wall();
    for (WandState& wand : told.wands) {
        wand.worldPosition = world_T_wall * wand.position;
        wand.worldOrientation = (view.orientation * wand.orientation).normalized();
    }
    return told;
}

std::vector<TrackerInfo> Tracking::describe(TimePoint now) const {
    std::vector<TrackerInfo> infos;
    for (std::size_t t = 0; t < trackers_.size(); ++t) {
        const Tracker& tracker = trackers_[t];
        TrackerInfo info{.name = tracker.setup.name,
                         .protocol = std::string(nameOf(tracker.setup.protocol)),
                         .address = tracker.setup.address};
        for (const auto& [name, sensor] : tracker.sensors) {
            SensorInfo told{.sensor = toString(name),
                            .poses = sensor.poses,
                            .refused = sensor.refused,
                            .ageMs = -1,
                            .straysMm = 1000 * sensor.filter.strays(),
                            .buttons = now - tracker.heard > kControlsCount ? 0 : sensor.buttons};
            for (const auto* all : {&headFollowers_, &wandFollowers_})
                for (const Follower& one : *all)
                    if (one.tracker == t && one.mount.sensor == name)
                        told.moves += (told.moves.empty() ? "" : ", ") + one.what;
            if (sensor.filter.any()) {
                told.ageMs = toMilliseconds(now - sensor.filter.last());
                // What was regular and has ceased has no rate.
                const Duration begun = sensor.filter.last() - sensor.windowBegan;
                const bool first = sensor.interval == 0 && begun >= kShortestRateWindow;
                const double interval =
                    first ? std::chrono::duration<double>(begun).count() / static_cast<double>(sensor.inWindow)
                          : sensor.interval;
                const double seconds = std::max(interval, told.ageMs < 1000 ? 0 : told.ageMs / 1000);
                told.rateHz = seconds > 0 ? 1 / seconds : 0;
            }
            info.sensors.push_back(std::move(told));
        }
        infos.push_back(std::move(info));
    }
    return infos;
}

}  // namespace tessera
