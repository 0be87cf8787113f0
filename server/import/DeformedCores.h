/// Meshes of a scene file that something bends, as cores.
#pragma once

#include "common/base/Error.h"
#include "common/cores/Deformation.h"
#include "common/cores/Skin.h"
#include "server/import/LoadedFile.h"

namespace tessera {

// Without material and joints. What a scene would refuse as a whole is left to `Drawable::check`.

/// A node's mesh within its lattice: around the mesh and at rest, where the file does not say otherwise.
[[nodiscard]] Expected<Deformation> readDeformation(LoadedFile& file, const proto::scene::Node& node);
/// At rest, where the file says no pose.
[[nodiscard]] Expected<Skin> readSkin(LoadedFile& file, const proto::scene::Skin& message);

}  // namespace tessera
