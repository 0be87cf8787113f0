/// Runs the confined importer on one file and collects what it says.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "server/import/Importer.h"

namespace tessera {

/// What came through the pipe whole and undamaged; its content is not yet checked.
struct ImporterOutput {
    Bytes scene;  ///< a SceneFile without blobs
    std::vector<Blob> blobs;
    std::vector<std::string> notes, faults;
    std::vector<std::string> files;  ///< that it says it has read or looked for, in the file's folder or below
};

/// What an importer writes into a pipe, to its end: bounded by the options, wrong hashes and orders refused.
/// `cutShort`: what to say where the pipe ends before.
[[nodiscard]] Expected<ImporterOutput> readImporterOutput(int pipe, const ImportOptions& options,
                                                          const std::function<Error()>& cutShort);

/// `file` must be an absolute path without symbolic links. Blocks; the child is gone when this returns.
[[nodiscard]] Expected<ImporterOutput> runImporter(const std::string& file, const ImportOptions& options);

}  // namespace tessera
