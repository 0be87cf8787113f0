/// Pose files: one query per line, `#` begins a comment, empty lines do not count.
///
/// `tx ty tz qw qx qy qz`: the pose of B relative to A; a second group of seven is the pose at the end of a motion.
/// Quaternions of any length above 0 are normalised. Units are the models'.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/Error.h"
#include "common/math/Ray.h"
#include "server/collision/query/TimeOfImpact.h"

namespace tessera {

struct PoseLine {
    Pose start;               ///< of scale 1
    std::optional<Pose> end;  ///< of a line of 14 numbers
    std::size_t line = 0;     ///< in the file, from 1
};

/// Translations beyond this leave the range in which the predicates are exact.
inline constexpr double kMaxPoseTranslation = 1e50;

/// kBadInput as `file:line: what is wrong`: a count that is neither 7 nor 14, a word that is no finite number, a
/// quaternion without length.
[[nodiscard]] Expected<std::vector<PoseLine>> parsePoses(std::string_view text, std::string_view file);

/// Also kNotFound, and kLimit for a file beyond 1 GiB.
[[nodiscard]] Expected<std::vector<PoseLine>> readPoses(const std::string& path);

/// A line of a file of rays: `ox oy oz dx dy dz`.
struct RayLine {
    Ray ray;
    std::size_t line = 0;
};
/// As parsePoses; also a direction without length.
[[nodiscard]] Expected<std::vector<RayLine>> parseRays(std::string_view text, std::string_view file);
[[nodiscard]] Expected<std::vector<RayLine>> readRays(const std::string& path);

}  // namespace tessera
