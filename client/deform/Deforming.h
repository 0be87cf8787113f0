/// How control points are led: bent, twisted or swollen along an axis, to and fro.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/Error.h"
#include "common/math/Types.h"

namespace tessera {

/// Along an axis of the box of the points at rest: its Z below, with X across. A. Barr, "Global and local deformations
/// of solid primitives" (SIGGRAPH 1984), has the formulas of the first two.
enum class DeformingKind : std::uint8_t {
    kBend,   ///< the box's line in the middle becomes an arc of this angle; its lower end stays
    kTwist,  ///< turned about that line, by this angle at the upper end
    kSwell,  ///< scaled across, by a share of 1 most in the middle, not at all at the ends
};

/// Which points are led how. Written KIND[-AXIS]:AMOUNT:SECONDS:NODE, "bend-x:-10..35:4:/garden/animal". A single
/// amount A goes from 0 to A, to -A and back, FROM..TO from one to the other and back, in so many seconds.
struct Deforming {
    DeformingKind kind = DeformingKind::kBend;
    int axis = -1;            ///< 0 to 2; below 0: the box's longest side
    double from = 0, to = 0;  ///< degrees; of kSwell per cent
    double seconds = 1;
    std::string node;  ///< what has control points at or below it

    /// kUsage says what is wrong, and how it is written.
    [[nodiscard]] static Expected<Deforming> parse(std::string_view words);
    /// After so many seconds: degrees or per cent.
    [[nodiscard]] double amountAt(double time) const;
};

/// The points, led so far. Points at rest that are all in one place, or not finite, stay. `amount` is finite, and no
/// less than -1e4 and no more than 1e4.
[[nodiscard]] std::vector<Vec3d> deformed(std::span<const Vec3d> rest, DeformingKind kind, int axis, double amount);

}  // namespace tessera
