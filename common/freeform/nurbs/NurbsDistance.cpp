#include "common/freeform/nurbs/NurbsDistance.h"

#include <algorithm>
#include <span>
#include <utility>

namespace tessera {
namespace {

/// At 1 the upper end itself, however sums are rounded: beyond it there may be no surface.
double parameterAt(const ParameterRange& over, double at) {
    return at < 1 ? std::min(over.lower + at * over.size(), over.upper) : over.upper;
}
Vec2d parametersAt(const ParameterRectangle& over, const Vec2d& at) {
    return {parameterAt(over.u, at.x()), parameterAt(over.v, at.y())};
}

class TrimMask final : public PatchMask {
public:
    TrimMask(const TrimRegion& region, std::span<const ParameterRectangle> over) : region_(region), over_(over) {}

    [[nodiscard]] Part partOf(std::size_t patch, const Vec2d& lower, const Vec2d& upper) const override {
        const Vec2d from = parametersAt(over_[patch], lower), to = parametersAt(over_[patch], upper);
        const RectangleSide side = region_.side(ParameterRectangle{{from.x(), to.x()}, {from.y(), to.y()}});
        return side == RectangleSide::kKept ? Part::kAll : side == RectangleSide::kCrossed ? Part::kSome : Part::kNone;
    }
    [[nodiscard]] bool has(std::size_t patch, const Vec2d& at) const override {
        return region_.side(parametersAt(over_[patch], at)) != TrimSide::kTrimmedAway;
    }

private:
    const TrimRegion& region_;
    std::span<const ParameterRectangle> over_;
};

}  // namespace

NurbsDistance::NurbsDistance(const NurbsSurface& surface) : surface_(surface) {
    for (ParameterPatch& p : bezierPatches(surface)) {
        patches_.push_back(std::move(p.patch));
        over_.push_back(p.over);
    }
}

std::optional<ClosestPoint> NurbsDistance::closestPoint(const Vec3d& place, double tolerance,
                                                        std::size_t maxParts) const {
    const TrimMask mask(surface_.region(), over_);
    std::optional<ClosestPoint> closest = tessera::closestPoint(
        patches_, place,
        {.tolerance = tolerance, .maxParts = maxParts, .mask = surface_.region().loops().empty() ? nullptr : &mask});
    if (closest) {
        const Vec2d at = parametersAt(over_[closest->patch], {closest->u, closest->v});
        closest->u = at.x();
        closest->v = at.y();
    }
    return closest;
}

}  // namespace tessera
