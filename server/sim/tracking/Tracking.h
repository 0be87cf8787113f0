/// From what trackers say to heads and wands, frame by frame.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/request/StatusRequests.h"
#include "common/wall/View.h"
#include "server/sim/tracking/PoseFilter.h"
#include "server/sim/view/TrackedHead.h"

namespace tessera {

/// What one datagram, or one read of a stream, says.
struct TrackerReading {
    std::size_t tracker = 0;  ///< in the wall's order
    TimePoint at;             ///< when it came, on this machine's steady clock
    std::vector<SensorReport> reports;
    bool connectionEnded = false;  ///< before the reports: what sticks and buttons said over it counts no more
};

/// Calibration, filters, silence. A pure state machine: readings and times in, heads and wands out, the same for the
/// same; it knows no socket. Not thread-safe.
///
/// A head whose tracker is silent stays where it was last expected; after `TrackerFilter::holdFor` it goes within
/// `easeFor` to where it would be without a tracker. What a wand's stick and buttons said counts while its sensor or
/// they themselves speak, so that a device which tells of changes alone may: after kControlsCount of silence the axes
/// are 0 and the buttons up until they are said again. A wand without a pose for `holdFor` is not tracked any more, and
/// what it said is forgotten.
class Tracking {
public:
    /// Of each tracker; others' sensors beyond are not looked at. Those that move somebody always are.
    static constexpr std::size_t kMaxSensors = 64;
    static constexpr std::chrono::milliseconds kControlsCount{250};
    /// Rates are told over at least so long: what waited somewhere comes at once.
    static constexpr std::chrono::milliseconds kRateWindow{500}, kShortestRateWindow{100};

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
        double interval = 0;  ///< seconds between poses in the last whole window
        TimePoint windowBegan{};
        std::uint64_t inWindow = 0;  ///< poses after the one that began it
        std::uint32_t buttons = 0;
    };
    /// What sticks and buttons said, as one wand has it.
    struct Controls {
        std::uint32_t buttons = 0;
        std::array<double, kMostAxes> axes{};
        int axisCount = 0;
        void take(const SensorReport& report);
        void forget();
    };
    struct Tracker {
        WallTracker setup;
        Mat3d axes;
        std::map<SensorName, Sensor> sensors;
        TimePoint heard{};  ///< anything of it
    };
    /// Something that follows a sensor.
    struct Follower {
        std::string what;  ///< "head viewer"
        std::size_t tracker = 0;
        TrackedMount mount;
        enum class State : std::uint8_t { kNever, kThere, kGone } state = State::kNever;
        // Wands':
        SensorName hand;  ///< whose buttons and axes are its own
        Controls controls;
        TimePoint heard{};  ///< its sensor, or its controls
    };
    void takeControls(std::size_t tracker, const SensorReport& report, TimePoint at);

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
