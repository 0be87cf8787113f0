/// A ray as the kernels take it. Inside of this library, and for its tests.
#pragma once

#include <optional>

#include "common/math/Ray.h"
#include "common/rays/RayKernels.h"

namespace tessera::rays {

struct AimedRay {
    PreparedRay ray{};
    double length = 1;  ///< a power of two, about that of the ray's direction: what its t and the kernels' differ by
    double before = 0;  ///< the kernels' ray begins so far along it, in theirs
    double limit = 0;   ///< theirs
    [[nodiscard]] double tOf(double t) const { return (before + t) / length; }
};

/// `reach`: no coordinate of the tree is larger. Nothing: the ray cannot meet anything there, is not finite or has no
/// direction.
[[nodiscard]] std::optional<AimedRay> aim(const Ray& ray, double maxT, double reach);

namespace sse2 {
extern const RayKernels kKernels;
}
namespace avx2 {
extern const RayKernels kKernels;
}

}  // namespace tessera::rays
