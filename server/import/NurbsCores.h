/// NURBS surfaces of a scene file as cores.
#pragma once

#include "common/base/Error.h"
#include "common/cores/NurbsSurface.h"
#include "proto/scene.pb.h"

namespace tessera {

/// Without its material. What is absent gets its default; refused is, in words, what a scene would refuse too.
[[nodiscard]] Expected<NurbsSurfaceCore> readNurbsSurface(const proto::scene::NurbsSurface& message);

}  // namespace tessera
