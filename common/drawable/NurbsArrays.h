/// A NurbsSurface's triangles.
#pragma once

#include "common/cores/NurbsSurface.h"
#include "common/drawable/Derivation.h"
#include "common/freeform/nurbs/NurbsSurface.h"

namespace tessera {

/// Of one surface in a scene; beyond: it is refused, and the tolerance has to be larger.
inline constexpr std::size_t kMostNurbsTriangles = 500'000;
/// Likewise: an edit is judged in the frame that it comes in. TessellationLimits::maxSums; of cubic surfaces the
/// triangles end sooner.
inline constexpr std::size_t kMostNurbsSums = std::size_t{1} << 27;

extern const Derivation kNurbsDerivation;

/// The surface that a core's fields stand for, or what is wrong with them. Its arrays have to be here.
[[nodiscard]] Expected<NurbsSurface> surfaceOfCore(const NurbsSurfaceCore& core);
/// The other way round. Its tolerance and material are those of a fresh core.
[[nodiscard]] NurbsSurfaceCore coreOfSurface(const NurbsSurface& surface);

}  // namespace tessera
