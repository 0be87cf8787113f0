/// What a tracker's bytes say of one sensor.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/base/Bytes.h"
#include "common/base/Error.h"
#include "common/wall/Tracking.h"

namespace tessera {

inline constexpr int kMostButtons = 32, kMostAxes = 8;
/// Of one datagram, or of one read of a stream; more are refused, or left for the next.
inline constexpr std::size_t kMostReports = 256;

/// In the tracker's own units and axes, numbers unchecked: whoever takes it looks whether it is a pose.
struct RawPose {
    Vec3d position = Vec3d::Zero();
    Quatd orientation = Quatd::Identity();
    bool turns = true;   ///< false: a place alone, as markers have
    bool placed = true;  ///< false: a rotation alone
};

/// Buttons and axes that it says nothing of stay what they were.
struct SensorReport {
    SensorName sensor;
    std::optional<RawPose> pose;
    std::uint32_t buttons = 0, buttonsSaid = 0;  ///< bit i: button i
    std::array<double, kMostAxes> axes{};
    std::uint32_t axesSaid = 0;
};

/// An orientation from the nine numbers of a rotation matrix. None where they are not a rotation, within what a few
/// digits round away.
[[nodiscard]] std::optional<Quatd> orientationOf(const Mat3d& matrix);

}  // namespace tessera
