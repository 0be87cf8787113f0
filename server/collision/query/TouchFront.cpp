#include "server/collision/query/TouchFront.h"

#include "server/collision/query/TouchSearch.h"
#include "server/collision/tree/TreeStorage.h"

namespace tessera {
namespace {

/// There is a node below the slot, in the tree as it is now.
bool hasNode(const TreeStorage& tree, kernel::Slot slot) {
    return slot < tree.children.size() && (tree.children[slot] & kernel::kLeafBit) == 0;
}

}  // namespace

TouchedPair TouchFront::firstTouching(const TriangleTree& a, const TriangleTree& b, const Affine3d& a_T_b,
                                      QueryWork& work, const TouchOptions& options) {
    using touch::Search;
    if (a.storage().empty() || b.storage().empty()) return {};
    if (work.exhausted()) return {Touch::kUnknown, {}};
    const bool hint = known_ && faces_.a < a.mesh().faceCount() && faces_.b < b.mesh().faceCount();
    if (hint) {
        ++work.triangleTests;
        if (trianglesIntersect(a.mesh().triangle(faces_.a), transformed(a_T_b, b.mesh().triangle(faces_.b))))
            return {Touch::kYes, faces_};
        if (work.exhausted()) return {Touch::kUnknown, {}};
    }
    const touch::TreePair pair(a, b, a_T_b, options);
    Search search(pair, Search::For::kAny, work);
    if (hint && hasNode(pair.treeA.storage(), around_.a) && hasNode(pair.treeB.storage(), around_.b)) {
        search.walk(around_);
        search.finish();
    }
    if (search.pairs().empty() && !search.exhausted()) {
        search.take(work);
        ++work.boxTests;
        if (pair.rootsOverlap()) {
            Search whole(pair, Search::For::kAny, work);
            whole.walk(touch::kRoots);
            whole.finish();
            return outcome(whole, work);
        }
        known_ = false;
        return {};
    }
    return outcome(search, work);
}

TouchedPair TouchFront::outcome(touch::Search& search, QueryWork& work) {
    search.take(work);
    known_ = !search.pairs().empty();
    if (!known_) return {search.exhausted() ? Touch::kUnknown : Touch::kNo, {}};
    faces_ = search.pairs().front();
    around_ = search.lastPlace();
    return {Touch::kYes, faces_};
}

}  // namespace tessera
