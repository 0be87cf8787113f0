/// Materials and images of a file as cores.
#pragma once

#include <map>
#include <string>
#include <utility>

#include "server/import/LoadedFile.h"
#include "server/import/SceneDraft.h"
#include "server/import/Spot.h"

namespace tessera {

/// Each of a file's is made once, when somebody names it. Errors name it. Not thread-safe.
class MaterialCores {
public:
    explicit MaterialCores(SceneDraft& draft) : draft_(draft) {}

    Expected<ObjectId> material(LoadedFile& file, const std::string& name);
    /// That of geometry which says this one, or none ("").
    Expected<ObjectId> worn(LoadedFile& file, const std::string& said, const Coating& paint);
    Expected<ObjectId> image(LoadedFile& file, const std::string& name);

private:
    using Key = std::pair<const LoadedFile*, std::string>;
    Expected<ObjectId> made(LoadedFile& file, const proto::scene::Material& message);
    /// The images that the material's own fields name.
    Expected<void> setImages(LoadedFile& file, const proto::scene::Material& message, Material& material);
    Expected<void> addLayers(LoadedFile& file, const proto::scene::Material& message, Material& material);
    /// What a material names besides: set after it is there.
    Expected<void> setParts(LoadedFile& file, const proto::scene::Material& message, ObjectId id);
    Expected<void> setUniforms(LoadedFile& file, const proto::scene::Material& message, ObjectId id);
    /// Its passes, and a coarser one.
    Expected<void> setOthers(LoadedFile& file, const proto::scene::Material& message, ObjectId id);

    SceneDraft& draft_;
    std::map<Key, ObjectId> materials_, images_;
    int depth_ = 0;  ///< of materials that name one another
};

}  // namespace tessera
