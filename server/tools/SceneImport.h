/// A file as a scene of its own.
#pragma once

#include <string>

#include "common/scene/Aspect.h"
#include "server/import/Importer.h"

namespace tessera {

struct FileScene {
    Aspect scene;
    ImportedScene imported;  ///< its counts, notes and `later`, with the scene's ids; the list is gone
};

/// The file's content below the root, under ids of this scene. Blocks; says on a terminal how far it is. Errors name
/// the file.
[[nodiscard]] Expected<FileScene> importAsScene(const std::string& path, ImportOptions options);

}  // namespace tessera
