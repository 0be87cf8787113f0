/// The keys of a Motion core (common/cores/Motion.h): what they must be, and the pose that they say at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "common/base/Error.h"
#include "common/math/Pose.h"

namespace tessera {

/// Scalars per key of Motion::keys: time, translation, rotation wxyz, scale.
inline constexpr std::size_t kScalarsPerKey = 11;

/// Says what is wrong with key frames: not a whole number of keys, none, times not ascending, a number that is not
/// finite, a rotation of length zero.
[[nodiscard]] Expected<void> checkKeys(std::span<const double> keys);

/// Of a key, by its number.
[[nodiscard]] inline double keyTime(std::span<const double> keys, std::size_t index) {
    return keys[index * kScalarsPerKey];
}

/// The pose at local time `seconds` under a Motion's mode. Keys have passed checkKeys. Linear between keys, rotation by
/// slerp along the shorter arc.
[[nodiscard]] Pose poseAt(std::span<const double> keys, std::int64_t mode, double seconds);

}  // namespace tessera
