/// Inlines and ProxyGroups of scene text: what names another file and does not read it yet.
#pragma once

#include "server/import/ImportedFiles.h"
#include "server/import/SceneDraft.h"

namespace tessera {

/// Makes the core of a node with such content. It names its file so that it is found from anywhere; what would inline
/// itself has failed already.
Expected<ObjectId> makeInline(SceneDraft& draft, const ImportedFiles& files, const LoadedFile& file,
                              const proto::scene::Node& node);

}  // namespace tessera
