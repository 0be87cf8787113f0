/// Smooth surfaces by the name of their scheme, whatever they are made of: one row of a table each.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/Error.h"
#include "common/freeform/SurfacePoint.h"

namespace tessera {

struct NearestPoint {
    std::uint32_t face = 0;
    double u = 0, v = 0;
    Vec3d point = Vec3d::Zero();  ///< of the surface, or of the Bézier patch that stands for it there
    double distance = 0;          ///< to that point
    double error = 0;             ///< the surface's own distance is within this of it
};

class EvaluatedSurface {
public:
    virtual ~EvaluatedSurface() = default;
    /// kBadInput, kRefused: there is no such point, in words without the place in a file. Not const: surfaces keep what
    /// they work out.
    [[nodiscard]] virtual Expected<SurfacePoint> at(std::uint32_t face, double u, double v) = 0;
    /// The point that is nearest to a place. kRefused: this kind cannot tell, or there is none.
    [[nodiscard]] virtual Expected<NearestPoint> nearest(const Vec3d& place, double tolerance) = 0;
    [[nodiscard]] virtual std::vector<std::string> notes() const { return {}; }
};

struct SurfaceScheme {
    std::string_view name;  ///< as --scheme has it
    /// `file` for messages: kBadInput as `file:line: what is wrong`, or `file: …` of what has no line.
    Expected<std::unique_ptr<EvaluatedSurface>> (*load)(std::string_view text, std::string_view file);
};

/// The first is taken where nobody says.
[[nodiscard]] std::span<const SurfaceScheme> surfaceSchemes();

}  // namespace tessera
