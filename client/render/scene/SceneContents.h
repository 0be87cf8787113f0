/// What a scene has that may be drawn: each drawable once, the nearest first.
#pragma once

#include <memory>
#include <vector>

#include "client/render/DrawMesh.h"
#include "client/render/scene/RenderScene.h"

namespace tessera {

struct SceneContent {
    ObjectId geometry, material;
    std::shared_ptr<const DrawMesh> mesh;  ///< on the screen that was looked from last
};

/// Of all that is shown, wherever it is; by the distance of the nearest box. Costs a look at each item.
[[nodiscard]] std::vector<SceneContent> contentsOf(const RenderScene& scene, const Vec3d& eyeWorld);

}  // namespace tessera
