#include "server/tools/evaluate/EvaluatedNurbs.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "common/freeform/nurbs/NurbsDistance.h"
#include "common/freeform/nurbs/ObjSurfaces.h"

namespace tessera {
namespace {

class EvaluatedNurbs final : public EvaluatedSurface {
public:
    explicit EvaluatedNurbs(std::vector<NurbsSurface> surfaces) : surfaces_(std::move(surfaces)) {}

    Expected<SurfacePoint> at(std::uint32_t patch, double u, double v) override {
        if (patch >= surfaces_.size())
            return fail(ErrorCode::kBadInput, fmt::format("there is no surface {}: the file has {}, counted from 0",
                                                          patch, surfaces_.size()));
        const NurbsSurface& surface = surfaces_[patch];
        const ParameterRectangle& domain = surface.domain();
        if (!(u >= domain.u.lower && u <= domain.u.upper && v >= domain.v.lower && v <= domain.v.upper))
            return fail(ErrorCode::kBadInput,
                        fmt::format("{:.9g} {:.9g} is not on surface {}, whose u goes from {:.9g} to {:.9g} and v from "
                                    "{:.9g} to {:.9g}",
                                    u, v, patch, domain.u.lower, domain.u.upper, domain.v.lower, domain.v.upper));
        const NurbsPoint point = evaluate(surface, u, v);
        if (point.side == TrimSide::kTrimmedAway)
            return fail(ErrorCode::kRefused, fmt::format("surface {} is trimmed away at {:.9g} {:.9g}", patch, u, v));
        return point.at;
    }

    Expected<NearestPoint> nearest(const Vec3d& place, double tolerance) override {
        if (ready_.empty())
            for (const NurbsSurface& surface : surfaces_) ready_.emplace_back(surface);
        std::optional<NearestPoint> best;
        double least = 0;
        for (std::size_t i = 0; i < ready_.size(); ++i) {
            const std::optional<ClosestPoint> found = ready_[i].closestPoint(place, tolerance);
            if (!found) continue;
            const double atLeast = found->distance - found->error;
            least = best ? std::min(least, atLeast) : atLeast;
            if (best && best->distance <= found->distance) continue;
            best = NearestPoint{static_cast<std::uint32_t>(i), found->u, found->v, found->point, found->distance, 0};
        }
        if (!best) return fail(ErrorCode::kRefused, "no surface has a point left");
        best->error = best->distance - least;
        return *best;
    }

private:
    std::vector<NurbsSurface> surfaces_;
    std::vector<NurbsDistance> ready_;  ///< made when first asked for
};

}  // namespace

Expected<std::unique_ptr<EvaluatedSurface>> loadNurbs(std::string_view text, std::string_view file) {
    Expected<std::vector<NurbsSurface>> surfaces = readNurbsObj(text, file);
    if (!surfaces) return tl::unexpected(surfaces.error());
    return std::make_unique<EvaluatedNurbs>(std::move(*surfaces));
}

}  // namespace tessera
