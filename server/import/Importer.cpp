#include "server/import/Importer.h"

#include "server/import/SceneAssembly.h"

namespace tessera {

Expected<ImportedScene> importScene(const std::string& path, ObjectId parent, const ImportOptions& options) {
    return importScenes(std::span(&path, 1), parent, options);
}

Expected<ImportedScene> importScenes(std::span<const std::string> paths, ObjectId parent,
                                     const ImportOptions& options) {
    SceneAssembly assembly(options);
    for (const std::string& path : paths)
        if (Expected<void> added = assembly.add(path, parent); !added) return tl::unexpected(added.error());
    return assembly.take();
}

}  // namespace tessera
