/// A drawable's mesh as screens draw it: resolved once, where the scene meets it, and shared from there to GL.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "client/render/DrawKinds.h"
#include "client/render/MeshClusters.h"
#include "common/drawable/Drawable.h"

namespace tessera {

/// Never the same twice in a process: names what somebody keeps a table of. Any thread.
[[nodiscard]] std::uint64_t nextSerial();

/// Immutable. Lists hold what they name, so that it outlives the update that puts another one in its place: what is
/// drawn for neighbours, uploaded ahead, or kept to be compared stays whole.
struct DrawMesh {
    std::uint64_t serial = 0;  ///< nextSerial's
    MeshKey key;
    MeshArrays arrays;   ///< resident
    bool sound = false;  ///< checkMesh's verdict
    /// By MeshCache alone. None of a small mesh, and of what came by edits of ranges: that may go on changing.
    std::vector<MeshCluster> clusters;
};

/// Null: nothing to be drawn, or its bytes are not here. Costs a look at all of it.
[[nodiscard]] std::shared_ptr<const DrawMesh> drawMeshOf(const Drawable& drawable);

}  // namespace tessera
