/// What assimp passes over in silence in the materials of an OBJ.
#pragma once

#include <string>

#include "server/import/reader/FolderFiles.h"
#include "server/import/reader/PlainScene.h"

namespace tessera {

/// Notes libraries that are not there, materials that none of its libraries defines, and images that a library moves or scales. Reads
/// `path` once more, line by line. Other files than OBJ have nothing of it.
void noteObjMaterials(const std::string& path, const FolderFiles& files, PlainScene& scene);

}  // namespace tessera
