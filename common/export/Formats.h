/// The writers of foreign formats, each in files of its own. What they have in common: who calls them has chosen the
/// nodes; a writer gives the bytes of one file, or of several, and notes what it loses. Numbers that are none are never
/// written.
#pragma once

#include <string>
#include <vector>

#include "common/base/ByteSlice.h"
#include "common/export/Export.h"
#include "common/export/ExportNotes.h"
#include "common/export/Selection.h"

namespace tessera {

/// What a writer writes from.
struct LeavingScene {
    const Aspect& scene;
    const Selection& selection;
    const ExportOptions& options;
    std::string path;  ///< where the file really lies, behind links: others beside it are named after it
    ExportNotes& notes;
};

/// One of the files, its bytes in order.
struct LeavingFile {
    std::string path;
    std::vector<ByteSlice> parts;
};

struct LeavingFiles {
    std::vector<LeavingFile> files;  ///< those that others name before those that name them
    std::size_t nodes = 0;           ///< none: there is nothing to write
    std::size_t triangles = 0;       ///< as in ExportReport
};

/// kLimit: a file of so many bytes would be too large.
[[nodiscard]] Expected<void> checkFileBytes(std::uint64_t bytes, const ExportOptions& options);

[[nodiscard]] Expected<LeavingFiles> writeGlb(const LeavingScene& leaving);
[[nodiscard]] Expected<LeavingFiles> writeGltf(const LeavingScene& leaving);
[[nodiscard]] Expected<LeavingFiles> writePly(const LeavingScene& leaving);
[[nodiscard]] Expected<LeavingFiles> writeStl(const LeavingScene& leaving);
[[nodiscard]] Expected<LeavingFiles> writeObj(const LeavingScene& leaving);
[[nodiscard]] Expected<LeavingFiles> writeUsda(const LeavingScene& leaving);
[[nodiscard]] Expected<LeavingFiles> writeVrml(const LeavingScene& leaving);
[[nodiscard]] Expected<LeavingFiles> writeCsv(const LeavingScene& leaving);

}  // namespace tessera
