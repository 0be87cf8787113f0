/// Runs the confined importer on one file and collects what it says.
#pragma once

#include <string>
#include <vector>

#include "server/import/Importer.h"

namespace tessera {

/// What came through the pipe whole and undamaged; its content is not yet checked.
struct ImporterOutput {
    Bytes scene;  ///< a SceneFile without blobs
    std::vector<Blob> blobs;
    std::vector<std::string> notes;
};

/// `file` must be an absolute path without symbolic links. Blocks; the child is gone when this returns.
[[nodiscard]] Expected<ImporterOutput> runImporter(const std::string& file, const ImportOptions& options);

}  // namespace tessera
