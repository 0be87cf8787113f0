/// Trackers of a wall: devices that say where heads and hands are, how their numbers become places in the wall's frame,
/// and which sensor moves whom. Values only. None of it is there unless the wall's file names it.
///
/// wall_T_sensor = frame · axes · tracker_T_sensor, then the mount's offset: wall_T_head = wall_T_sensor ·
/// sensor_T_head.
#pragma once

#include <array>
#include <chrono>
#include <compare>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/Error.h"
#include "common/math/Types.h"

namespace tessera {

/// What a device speaks. Lengths: DTrack says millimetres, the others metres, unless `WallTracker::metresPerUnit` says.
enum class TrackerProtocol : std::uint8_t {
    kDtrack,  ///< datagrams come to `address`
    kOsc,     ///< datagrams come to `address`
    kVrpn,    ///< we dial the device `address`
};
[[nodiscard]] std::string_view nameOf(TrackerProtocol protocol);

/// How poses are smoothed and carried to the instant at which they are shown (server/sim/tracking/PoseFilter.h).
struct TrackerFilter {
    bool enabled = true;             ///< false: each pose as it comes
    double jitterMillimetres = 0.5;  ///< what the tracker's positions stray by at rest, standard deviation
    double jitterDegrees = 0.05;     ///< the same of its rotations
    std::chrono::milliseconds longestPrediction{60};  ///< beyond the last pose; 0: none
    double jumpMetres = 0.5;                  ///< farther than that from where it should be: not believed at first
    std::chrono::milliseconds holdFor{3000};  ///< silence after which a head goes back to the file's place
    std::chrono::milliseconds easeFor{2000};  ///< that it takes
};

struct WallTracker {
    std::string name;
    TrackerProtocol protocol = TrackerProtocol::kDtrack;
    std::string address;                     ///< "HOST:PORT" to listen at; of VRPN see parseVrpnUrl
    std::string buttonDevice, analogDevice;  ///< VRPN's, at the same server; empty: the tracker's own name
    Vec3d position = Vec3d::Zero();          ///< of the tracker's origin in the wall's frame, metres
    Quatd orientation = Quatd::Identity();
    std::string axes = "x y z";          ///< which of its axes the wall's x, y and z are: see parseAxes
    double metresPerUnit = 0;            ///< 0: the protocol's
    std::vector<std::string> allowFrom;  ///< addresses whose datagrams are read (base/HostRange.h); none: all
    TrackerFilter filter;

    [[nodiscard]] double metresPerOwnUnit() const {
        return metresPerUnit > 0 ? metresPerUnit : protocol == TrackerProtocol::kDtrack ? 0.001 : 1.0;
    }
};

/// What has a pose at a tracker; each kind is numbered by itself.
enum class SensorKind : std::uint8_t { kBody, kFlystick, kTool, kMarker };
[[nodiscard]] std::string_view nameOf(SensorKind kind);
struct SensorName {
    SensorKind kind = SensorKind::kBody;
    int number = 0;
    auto operator<=>(const SensorName&) const = default;
};
/// "body 0".
[[nodiscard]] std::string toString(const SensorName& sensor);

/// What sits on a sensor: a head between its eyes, a wand's tip with -Z ahead.
struct TrackedMount {
    std::string tracker;
    SensorName sensor;
    Vec3d offset = Vec3d::Zero();  ///< metres, in the sensor's axes as the wall names them
    Quatd turn = Quatd::Identity();
};
struct WallHead {
    std::string user;
    TrackedMount mount;
};
struct WallWand {
    std::string name;
    TrackedMount mount;
};
struct WallTracking {
    std::vector<WallTracker> trackers;
    std::vector<WallHead> heads;
    std::vector<WallWand> wands;
    [[nodiscard]] bool any() const { return !trackers.empty(); }
};

/// "x z -y": the wall's x is the tracker's x, its y the tracker's z, its z the tracker's -y. Spaces may be left out. As
/// a matrix that takes the tracker's coordinates to the wall's. Its determinant is -1 for left-handed trackers.
/// kBadInput.
[[nodiscard]] Expected<Mat3d> parseAxes(std::string_view text);

/// "vrpn://HOST:PORT/DEVICE"; without a port VRPN's own, 3883.
struct VrpnUrl {
    std::string host;
    std::uint16_t port = 3883;
    std::string device;
};
[[nodiscard]] Expected<VrpnUrl> parseVrpnUrl(std::string_view text);

}  // namespace tessera
