/// Where what is loaded from a file comes to stand.
#pragma once

#include <optional>

#include "common/base/Error.h"
#include "common/math/Types.h"

namespace tessera {

/// Which way is up in a file's coordinates. kOfFile: as the file says, else as files of its kind mostly have it.
enum class UpAxis : std::uint8_t { kOfFile, kY, kZ };

/// Lengths are units of the node that it comes under; +Y is up there.
struct Placing {
    /// Where the file's origin comes; with `fit` the middle of its underside. None: the origin.
    std::optional<Vec3d> at;
    std::optional<double> scale;  ///< above 0
    std::optional<double> fit;    ///< above 0, instead of `scale`: how long the longest side of its box becomes
    UpAxis up = UpAxis::kOfFile;

    /// Whether a person has said anything.
    [[nodiscard]] bool said() const { return at || scale || fit || up != UpAxis::kOfFile; }
};

/// Where anything may be placed, and how large or small it may become.
inline constexpr double kMaxPlacingCoordinate = 1e15, kMaxPlacingScale = 1e12;

/// What is wrong with it.
[[nodiscard]] Expected<void> checkPlacing(const Placing& placing);

}  // namespace tessera
