/// Scenes that assimp itself finds fault with: what is sound in them is kept.
#pragma once

#include <set>
#include <string>
#include <vector>

struct aiScene;

namespace tessera {

/// Takes away what would lead whoever goes through the scene astray: nodes, meshes, bones and channels that are null,
/// meshes without vertices, faces, weights and morph targets of vertices that do not exist. Materials that do not exist
/// become the first, or a plain one. Cameras and lights are as they were. Returns what was taken away, in words.
/// Whatever it takes away is not deleted: nor is the scene.
std::set<std::string> mendScene(aiScene& scene);

/// Takes away faces, lines and points of vertices that do not exist or are not finite, and meshes of which nothing is
/// left; says what of each mesh, in words. Before assimp's own steps: they would smooth normals with what is not
/// finite.
std::vector<std::string> leaveOutUnsound(aiScene& scene);

}  // namespace tessera
