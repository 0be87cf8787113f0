/// From what trackers say to heads and wands, frame by frame.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/codec/ApplicationTracking.h"
#include "common/wall/View.h"
#include "server/sim/frame/TrackedHead.h"
#include "server/sim/tracking/PoseFilter.h"

namespace tessera {

/// What one datagram, or one read of a stream, says.
struct TrackerReading {
    std::size_t tracker = 0;  ///< in the wall's order
    TimePoint at;             ///< when it came, on this machine's steady clock
    std::vector<SensorReport> reports;
};

/// Calibration, filters, silence. A pure state machine: readings and times in, heads and wands out, the same for the
/// same; it knows no socket. Not thread-safe.
///
/// A head whose tracker is silent stays where it was last expected; after `TrackerFilter::holdFor` it goes within
/// `easeFor` to where it would be without a tracker. A wand that is silent for `holdFor` is not tracked any more, and
/// none of its buttons is pressed.
class Tracking {
public:
    /// Of each tracker; others' sensors beyond are not looked at. Those that move somebody always are.
    static constexpr std::size_t kMaxSensors = 64;

    /// The wall has passed checkWall.
    explicit Tracking(const Wall& wall);

    void take(const TrackerReading& reading);
    /// Where everybody is in a frame that is made now and shown at `shown`. Returns what a person should be told: a
    /// tracker that speaks, falls silent, speaks again.
    [[nodiscard]] std::vector<std::string> advance(TimePoint now, TimePoint shown);

    /// As of the last `advance`; only those that the wall's file has a tracker for. World poses of wands are `poses`'.
    [[nodiscard]] const std::vector<TrackedHead>& heads() const { return heads_; }
    [[nodiscard]] const std::vector<WandState>& wands() const { return wands_; }
    /// What applications are told of a frame with this view.
    [[nodiscard]] notice::Poses poses(FrameNumber frame, const View& view) const;
    /// The sensors' part: what the bytes cost, who brings them knows.
    [[nodiscard]] std::vector<TrackerInfo> describe(TimePoint now) const;

private:
    struct Sensor {
        explicit Sensor(const TrackerFilter& settings) : filter(settings) {}
        PoseFilter filter;
        std::uint64_t poses = 0, refused = 0;
        double interval = 0;  ///< seconds between poses, of late
        std::uint32_t buttons = 0;
        std::array<double, kMostAxes> axes{};
        int axisCount = 0;
        TimePoint heard{};  ///< anything of it
    };
    struct Tracker {
        WallTracker setup;
        Mat3d axes;
        std::map<SensorName, Sensor> sensors;
    };
    /// Something that follows a sensor.
    struct Follower {
        std::string what;  ///< "head viewer"
        std::size_t tracker = 0;
        TrackedMount mount;
        enum class State : std::uint8_t { kNever, kThere, kGone } state = State::kNever;
    };

    [[nodiscard]] Follower follower(std::string what, const TrackedMount& mount) const;
    [[nodiscard]] const Sensor* sensorOf(const Follower& follower) const;
    [[nodiscard]] RawPose inWall(const Tracker& tracker, const RawPose& raw) const;
    /// How much of the follower's place is the tracker's, and what is to be said of a change.
    [[nodiscard]] double shareOf(Follower& follower, TimePoint now, std::vector<std::string>& said) const;

    std::vector<Tracker> trackers_;
    std::vector<Follower> headFollowers_, wandFollowers_;
    std::vector<TrackedHead> heads_;
    std::vector<WandState> wands_;
};

}  // namespace tessera
