/// The camera in use: the first enabled one in document order, followed through the scene's lists; and those after it.
#pragma once

#include <cstdint>
#include <functional>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "common/scene/Aspect.h"

namespace tessera {

/// Document order is depth-first, children in order; what a Switch hides is not there.
///
/// Watches the nodes that bear a Camera and those above them, and nothing else. A list that touches none of these costs
/// a look-up per entry; one that does costs as much as there are watched nodes. Not thread-safe.
class FirstCamera {
public:
    /// After each list applied to the scene, with that list; null: anything may have changed.
    void update(const Aspect& scene, const ChangeList* list);

    /// The node that bears it; none: no camera is enabled and shown.
    [[nodiscard]] ObjectId node() const { return first_; }
    /// The camera of that number, from 0, enabled or not; none: fewer are shown. Costs as much as there are watched
    /// nodes.
    [[nodiscard]] ObjectId numbered(const Aspect& scene, std::size_t number) const;
    /// Nodes looked at since the beginning, to find bearers or the first of them.
    [[nodiscard]] std::uint64_t nodesVisited() const { return visited_; }

private:
    void findBearers(const Aspect& scene);
    /// Whether the nodes that bear cameras became others.
    [[nodiscard]] bool noteBearers(const Aspect& scene, const ChangeList& list);
    /// Whether another camera may be the first, the bearers being the same.
    [[nodiscard]] bool concerns(const Aspect& scene, const ChangeList& list) const;
    void watch(const Aspect& scene);
    /// In document order through what is watched and shown, until `isIt` says of a camera's node that it is.
    [[nodiscard]] ObjectId findBelow(const Aspect& scene, ObjectId id,
                                     const std::function<bool(const Node&)>& isIt) const;

    std::unordered_set<ObjectId> bearers_;  ///< in the tree or not, enabled or not
    /// Bearers and all nodes above them → the watched ones among their children, in any order.
    std::unordered_map<ObjectId, std::vector<ObjectId>> watched_;
    /// Watched nodes with a Switch → how many children they had: another number, and another child may be shown.
    std::unordered_map<ObjectId, std::size_t> switchNodes_;
    std::unordered_set<ObjectId> switchCores_;
    ObjectId first_;
    mutable std::uint64_t visited_ = 0;
};

}  // namespace tessera
