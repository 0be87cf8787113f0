#include "server/sim/frame/Copies.h"

#include <algorithm>

#include "common/cores/Movie.h"
#include "server/rules/SceneRules.h"

namespace tessera {

CopyMade makeCopy(const Aspect& scene, const CopyOrder& order) {
    Expected<Clone> clone = cloneList(scene, order.node, order.options);
    if (!clone) return {.ticket = order.ticket, .node = tl::unexpected(clone.error()), .parts = {}, .named = {}};
    std::vector<Blob> named = blobsOf(clone->list);
    // Whoever commits parts does not look at them as a whole. What may be refused once others have edited stays whole, and is.
    const bool bringsFilms = std::ranges::find(clone->list.creations, typeOf<Movie>(), &Creation::type) != clone->list.creations.end();
    LoadParts parts;
    if (bringsFilms || !checkRules(scene, clone->list, {})) {
        parts.objects = clone->objects;
        parts.lists.push_back(std::move(clone->list));
    } else {
        parts = cutForFrames(std::move(clone->list));
    }
    std::uint64_t bytes = 0;
    for (const ChangeList& list : parts.lists) bytes += memoryWithoutArrays(list);
    return {.ticket = order.ticket, .node = clone->node, .parts = std::move(parts), .named = std::move(named), .bytes = bytes};
}

}  // namespace tessera
