/// Movies of scene text: films that are named, and read by nobody here.
#pragma once

#include <map>

#include "server/import/MaterialCores.h"

namespace tessera {

/// A Movie that a file places again is the same core: the same film plays. Not thread-safe.
class MovieCores {
public:
    MovieCores(SceneDraft& draft, MaterialCores& materials) : draft_(draft), materials_(materials) {}

    /// Each plays into an image of its own.
    Expected<ObjectId> movie(LoadedFile& file, const proto::scene::Movie& message);

private:
    SceneDraft& draft_;
    MaterialCores& materials_;
    std::map<const LoadedFile*, std::map<const proto::scene::Movie*, ObjectId>> cores_;
};

}  // namespace tessera
