#include "server/sim/frame/Copies.h"

#include <algorithm>

#include "common/cores/Movie.h"
#include "server/rules/SceneRules.h"
#include "server/sim/commit/EditHistory.h"
#include "server/sim/frame/LoadParts.h"

namespace tessera {

Preparation makeCopy(const Aspect& scene, Preparation order) {
    Expected<Clone> clone = cloneList(scene, order.node, *order.copy);
    if (!clone) {
        order.refused = clone.error();
        return order;
    }
    order.top = clone->node;
    order.objects = clone->objects;
    order.arrays = blobsOf(clone->list);
    // Whoever commits parts does not look at them as a whole. What may be refused once others have edited stays whole,
    // and is.
    const bool bringsFilms =
        std::ranges::find(clone->list.creations, typeOf<Movie>(), &Creation::type) != clone->list.creations.end();
    if (bringsFilms || !checkRules(scene, clone->list, {}))
        order.lists.push_back(std::move(clone->list));
    else
        order.lists = cutForFrames(std::move(clone->list));
    for (const ChangeList& list : order.lists) order.bytes += memoryWithoutArrays(list);
    return order;
}

}  // namespace tessera
