#include "server/tools/evaluate/EvaluatedNurbs.h"

#include <fmt/format.h>

#include "common/freeform/nurbs/ObjSurfaces.h"

namespace tessera {
namespace {

class EvaluatedNurbs final : public EvaluatedSurface {
public:
    explicit EvaluatedNurbs(std::vector<NurbsSurface> surfaces) : surfaces_(std::move(surfaces)) {}

    Expected<SurfacePoint> at(std::uint32_t patch, double u, double v) override {
        if (patch >= surfaces_.size())
            return fail(ErrorCode::kBadInput, fmt::format("there is no surface {}: the file has {}, counted from 0", patch, surfaces_.size()));
        const NurbsSurface& surface = surfaces_[patch];
        const ParameterRectangle& domain = surface.domain();
        if (!(u >= domain.u.lower && u <= domain.u.upper && v >= domain.v.lower && v <= domain.v.upper))
            return fail(ErrorCode::kBadInput, fmt::format("{:.9g} {:.9g} is not on surface {}, whose u goes from {:.9g} to {:.9g} and v from {:.9g} to {:.9g}", u, v, patch,
                                                          domain.u.lower, domain.u.upper, domain.v.lower, domain.v.upper));
        const NurbsPoint point = evaluate(surface, u, v);
        if (point.side == TrimSide::kTrimmedAway) return fail(ErrorCode::kRefused, fmt::format("surface {} is trimmed away at {:.9g} {:.9g}", patch, u, v));
        return point.at;
    }

private:
    std::vector<NurbsSurface> surfaces_;
};

}  // namespace

Expected<std::unique_ptr<EvaluatedSurface>> loadNurbs(std::string_view text, std::string_view file) {
    Expected<std::vector<NurbsSurface>> surfaces = readNurbsObj(text, file);
    if (!surfaces) return tl::unexpected(surfaces.error());
    return std::make_unique<EvaluatedNurbs>(std::move(*surfaces));
}

}  // namespace tessera
