#include "server/tools/evaluate/EvaluatedSurface.h"

#include <array>

#include "server/tools/evaluate/EvaluatedNurbs.h"
#include "server/tools/evaluate/EvaluatedSubdivision.h"

namespace tessera {

std::span<const SurfaceScheme> surfaceSchemes() {
    static constexpr std::array kSchemes{
        SurfaceScheme{"catmull-clark", loadSubdivision<SubdivisionScheme::kCatmullClark>},
        SurfaceScheme{"loop", loadSubdivision<SubdivisionScheme::kLoop>},
        SurfaceScheme{"nurbs", loadNurbs},
        SurfaceScheme{"bilinear", loadSubdivision<SubdivisionScheme::kBilinear>},
    };
    return kSchemes;
}

}  // namespace tessera
