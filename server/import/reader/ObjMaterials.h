/// What assimp passes over in silence in the materials of an OBJ.
#pragma once

#include <set>
#include <string>
#include <string_view>

#include "server/import/reader/FolderFiles.h"
#include "server/import/reader/PlainScene.h"

namespace tessera {

/// What an OBJ says of materials.
struct ObjNames {
    std::set<std::string> libraries, used;
    void add(std::string_view text);
};

/// Notes libraries that are not there, materials that none of its libraries defines, and images that a library moves or
/// scales. Other files than OBJ have nothing of it.
void noteObjMaterials(const ObjNames& names, const FolderFiles& files, PlainScene& scene);
/// The same of a file that is read once more, line by line.
void noteObjMaterials(const std::string& path, const FolderFiles& files, PlainScene& scene);

}  // namespace tessera
