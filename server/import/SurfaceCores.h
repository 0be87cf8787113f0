/// Subdivision surfaces, particles, glyphs and volumes of a scene file as cores.
#pragma once

#include "common/base/Error.h"
#include "common/cores/Glyphs.h"
#include "common/cores/Particles.h"
#include "common/cores/SubdivisionSurface.h"
#include "common/cores/Volume.h"
#include "server/import/LoadedFile.h"

namespace tessera {

// Without material. What is absent gets its default; what a scene would refuse as a whole is left to `Drawable::check`.

[[nodiscard]] Expected<SubdivisionSurface> readSubdivisionSurface(const proto::scene::SubdivisionSurface& message);
[[nodiscard]] Expected<Particles> readParticles(const proto::scene::Particles& message);
[[nodiscard]] Expected<Glyphs> readGlyphs(const proto::scene::Glyphs& message);
[[nodiscard]] Expected<Volume> readVolume(const LoadedFile& file, const proto::scene::Volume& message);

}  // namespace tessera
