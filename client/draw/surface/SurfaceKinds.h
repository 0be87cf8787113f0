/// The surfaces that there are: a row of the table in Surface.cpp each.
#pragma once

#include "client/draw/surface/Surface.h"

namespace tessera {

[[nodiscard]] Expected<std::unique_ptr<Surface>> makeOsMesaSurface(const SurfaceOptions& options);
[[nodiscard]] Expected<std::unique_ptr<Surface>> makeEglSurface(const SurfaceOptions& options);

}  // namespace tessera
