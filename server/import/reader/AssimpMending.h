/// Scenes that assimp itself finds fault with: what is sound in them is kept.
#pragma once

#include <set>
#include <string>

struct aiScene;

namespace tessera {

/// Takes away what would lead whoever goes through the scene astray: nodes, meshes, bones and channels that are null, meshes without vertices, faces,
/// weights and morph targets of vertices that do not exist. Materials that do not exist become the first, or a plain one. Cameras and lights are as they
/// were. Returns what was taken away, in words. Whatever it takes away is not deleted: nor is the scene.
std::set<std::string> mendScene(aiScene& scene);

}  // namespace tessera
