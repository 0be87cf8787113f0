#include "server/rules/SceneRules.h"

#include <algorithm>
#include <iterator>

#include "common/cores/Movie.h"
#include "server/rules/ImageCheck.h"
#include "server/rules/KeyFramesCheck.h"
#include "server/rules/ManipulatorCheck.h"
#include "server/rules/MaterialCheck.h"
#include "server/rules/MovieCheck.h"
#include "server/rules/NameCheck.h"

namespace tessera {

Sound checkRules(const Aspect& scene, const ChangeList& list, const std::set<ObjectId>& movies) {
    if (Sound play = checkKeyFrames(scene, list); !play) return play;
    if (Sound hold = checkManipulators(scene, list); !hold) return hold;
    if (Sound look = checkMaterials(list); !look) return look;
    if (Sound read = checkNames(list); !read) return read;
    if (Sound show = checkImages(scene, list); !show) return show;
    return checkMovies(scene, list, movies);
}

void SceneRules::follow(const Aspect& scene, const ChangeList* list) {
    if (!list) {
        movies_.clear();
        std::ranges::copy_if(scene.ids(), std::inserter(movies_, movies_.end()),
                             [&](ObjectId id) { return scene.get<Movie>(id); });
        return;
    }
    for (const Creation& creation : list->creations)
        if (creation.type == typeOf<Movie>()) movies_.insert(creation.id);
    if (movies_.empty()) return;
    for (const ObjectId id : list->destructions) movies_.erase(id);
}

}  // namespace tessera
