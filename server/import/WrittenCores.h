/// Cores that an author writes in the words of the table of types: `core { … }`.
#pragma once

#include "server/import/MaterialCores.h"

namespace tessera {

/// Makes the core of a node with such content, of any type that the table knows.
Expected<ObjectId> makeWritten(SceneDraft& draft, MaterialCores& materials, LoadedFile& file,
                               const proto::scene::Node& node, const Coating& paint);

}  // namespace tessera
