#include "common/freeform/nurbs/FlatPatches.h"

#include <array>
#include <string>
#include <utility>

#include "common/freeform/PatchBounds.h"

namespace tessera {

Expected<std::vector<FlatPatch>> flatPatches(const NurbsSurface& surface, double tolerance, const FlatPatchLimits& limits) {
    if (!(tolerance > 0)) return fail(ErrorCode::kBadInput, "a tolerance has to be above 0");
    struct Part {
        ParameterPatch part;
        int halvings = 0;
        bool kept = false;  // all of it: nothing smaller has to be asked for
    };
    std::vector<FlatPatch> flat;
    std::vector<ParameterPatch> whole = bezierPatches(surface);
    std::vector<Part> open;
    for (ParameterPatch& p : whole) {
        open.push_back({std::move(p)});
        while (!open.empty()) {
            Part part = std::move(open.back());
            open.pop_back();
            ParameterRectangle& over = part.part.over;
            RectangleSide side = RectangleSide::kKept;
            if (!part.kept) side = surface.region().side(over);
            if (side == RectangleSide::kTrimmedAway) continue;
            const double deviation = facetDeviation(part.part.patch);
            if (deviation <= tolerance) {
                if (flat.size() == limits.maxPatches)
                    return fail(ErrorCode::kLimit, "more than " + std::to_string(limits.maxPatches) + " patches for this tolerance");
                flat.push_back({std::move(part.part.patch), over, deviation, side});
                continue;
            }
            if (part.halvings == limits.maxHalvings)
                return fail(ErrorCode::kLimit, "a patch is not as flat as the tolerance after " + std::to_string(limits.maxHalvings) + " halvings");
            const PatchAxis axis = lessFlatAxis(part.part.patch);
            std::array<BezierPatch, 2> halves = split(part.part.patch, axis);
            ParameterRectangle below = over, above = over;
            const ParameterRange& range = axis == PatchAxis::kU ? over.u : over.v;
            const double middle = range.lower + 0.5 * range.size();
            (axis == PatchAxis::kU ? below.u : below.v).upper = middle;
            (axis == PatchAxis::kU ? above.u : above.v).lower = middle;
            const bool kept = side == RectangleSide::kKept;
            open.push_back({{std::move(halves[1]), above}, part.halvings + 1, kept});
            open.push_back({{std::move(halves[0]), below}, part.halvings + 1, kept});
        }
    }
    return flat;
}

}  // namespace tessera
