/// The materials of an OBJ: assimp reads them, and this names what it passes over in silence.
#pragma once

#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "server/import/reader/FolderFiles.h"
#include "server/import/reader/PlainScene.h"

namespace tessera {

/// What an OBJ says of materials.
struct ObjNames {
    std::set<std::string> libraries, used;
    void add(std::string_view text);
};

/// Materials as those that assimp reads, by their names in the file: assimp is shown a file of one triangle for each of
/// `used`, in the place of the OBJ at `path`. Adds them, and their pictures, to the scene; notes what is left out.
[[nodiscard]] std::map<std::string, std::string> readObjMaterials(const std::vector<std::string>& libraries,
                                                                  const std::vector<std::string>& used,
                                                                  const std::string& path, const FolderFiles& files,
                                                                  const ReadLimits& limits, PlainScene& scene);

/// Notes libraries that are not there, materials that none of its libraries defines, and images that a library moves or
/// scales. Other files than OBJ have nothing of it.
void noteObjMaterials(const ObjNames& names, const std::string& path, const FolderFiles& files, PlainScene& scene);
/// The same of a file that is read once more, line by line.
void noteObjMaterials(const std::string& path, const FolderFiles& files, PlainScene& scene);

}  // namespace tessera
