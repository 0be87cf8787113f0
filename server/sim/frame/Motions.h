/// Key-framed motion: where each animated Transform wants to be in the next frame.
#pragma once

#include <span>
#include <vector>

#include "common/math/Pose.h"
#include "common/scene/Aspect.h"

namespace tessera {

/// Scalars per key of Motion::keys: time, translation, rotation wxyz, scale.
inline constexpr std::size_t kScalarsPerKey = 11;

/// Says what is wrong with key frames: not a whole number of keys, none, times not ascending, a number that is not
/// finite, a rotation of length zero.
[[nodiscard]] Expected<void> checkKeys(std::span<const double> keys);

/// The pose at local time `seconds` under a Motion's mode. Keys have passed checkKeys. Linear between keys, rotation by
/// slerp along the shorter arc.
[[nodiscard]] Pose poseAt(std::span<const double> keys, std::int64_t mode, double seconds);

/// One playing motion's wish.
struct MotionStep {
    ObjectId motion;
    ObjectId target;  ///< a Transform
    double time = 0;  ///< the motion's local time if the wish is granted
    Pose pose;
};

/// All playing motions with sound keys, by ascending id, `seconds` further than they are. Of several motions with one
/// target the last (highest id) decides.
[[nodiscard]] std::vector<MotionStep> advanceMotions(const Aspect& scene, std::span<const ObjectId> motions,
                                                     double seconds);

}  // namespace tessera
