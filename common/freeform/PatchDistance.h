/// The point of some Bézier patches that is nearest to a place, with a proof of how near: best first over parts of
/// patches.
///
/// A part's points are no nearer than its control points are along any direction (hull), here from the place to the
/// part's middle: off by the square of the part's size, so that halving converges fast. Above, the best point found, by
/// Gauss-Newton steps clamped to the patch. Compare Ma and Hewitt 2003 (point inversion by subdivision), Johnson and
/// Cohen 1998 (lower and upper bounds). Pure; any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "common/freeform/BezierPatch.h"

namespace tessera {

struct ClosestPoint {
    std::size_t patch = 0;
    double u = 0, v = 0;  ///< of that patch, in [0, 1]
    Vec3d point = Vec3d::Zero();
    double distance = 0;
    double error =
        0;  ///< no point of the patches is nearer than distance − error, but for rounding (1e-14 of the coordinates)
};

/// Which part of patches counts: what trimming leaves.
class PatchMask {
public:
    enum class Part : std::uint8_t { kAll, kSome, kNone };
    virtual ~PatchMask() = default;
    /// Of the rectangle from `lower` to `upper` of a patch's (u, v). kAll and kNone are true of all its points.
    [[nodiscard]] virtual Part partOf(std::size_t patch, const Vec2d& lower, const Vec2d& upper) const = 0;
    [[nodiscard]] virtual bool has(std::size_t patch, const Vec2d& at) const = 0;
};

struct ClosestPointOptions {
    double tolerance = 1e-9;        ///< the error that is aimed at, in the patches' units
    std::size_t maxParts = 20'000;  ///< that are looked at; then the answer is what was found, with its error. Many are
                                    ///< as near in a sphere's centre
    const PatchMask* mask = nullptr;
};

/// Nothing where there are no patches, where the mask leaves no point that was found, or where the place is no number.
[[nodiscard]] std::optional<ClosestPoint> closestPoint(std::span<const BezierPatch> patches, const Vec3d& place,
                                                       const ClosestPointOptions& options = {});

}  // namespace tessera
