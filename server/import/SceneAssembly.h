/// Builds one change list out of checked scene files: places nodes as often as they are used.
#pragma once

#include <string>

#include "server/import/AnimationParts.h"
#include "server/import/ContentCores.h"
#include "server/import/ImportedFiles.h"
#include "server/import/Importer.h"
#include "server/import/MaterialCores.h"
#include "server/import/NodeCount.h"
#include "server/import/NodeReferences.h"
#include "server/import/PlacedNodes.h"
#include "server/import/SavedObjects.h"
#include "server/import/SceneDraft.h"

namespace tessera {

/// One import under way: walks the files and conducts who makes cores, who places nodes, who looks names up. Not
/// thread-safe. After an error it is of no further use.
class SceneAssembly {
public:
    /// `options` outlive it.
    explicit SceneAssembly(const ImportOptions& options) : draft_(options) {}

    /// Reads the file (and what it imports) and places its content under `parent`.
    [[nodiscard]] Expected<void> add(const std::string& path, ObjectId parent);
    /// All that was added; fails where the whole makes no sense (server/rules), with the place where that was written.
    [[nodiscard]] Expected<ImportedScene> take();

private:
    Expected<void> placeFile(LoadedFile& file, const Spot& spot);
    Expected<void> placeNode(LoadedFile& file, const proto::scene::Node& node, const Spot& spot);
    Expected<void> placeImport(LoadedFile& file, const proto::scene::Node& node, const Spot& spot);
    Expected<void> placeInstance(LoadedFile& file, const proto::scene::Node& instance, Spot spot);
    [[nodiscard]] tl::unexpected<Error> refusal(const Fault& fault) const;

    SceneDraft draft_;
    ImportedFiles files_{draft_};
    NodeCount count_{draft_, files_};
    PlacedNodes nodes_{draft_};
    MaterialCores materials_{draft_};
    ContentCores contents_{draft_, files_, materials_};
    NodeReferences names_{draft_};
    AnimationParts parts_{draft_, materials_, names_};
    SavedObjects saved_{draft_, files_, nodes_};
};

}  // namespace tessera
