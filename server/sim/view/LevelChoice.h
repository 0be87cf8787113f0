/// Which level of detail each user sees: chosen once for a wall, by the server, as a part of the scene.
#pragma once

#include <cstdint>
#include <set>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "common/scene/ChildChoice.h"
#include "server/sim/view/Lookers.h"

namespace tessera {

/// The level that a user sees next who sees `level` now. `measure`: the distance, or the size in pixels, as the core
/// wants it. NaN changes nothing. A range counts as passed when it is by the core's share of it: so a measure that
/// stays within that share of a range makes one step at most, and none back.
[[nodiscard]] std::size_t nextLevel(const DistanceLOD& lod, std::size_t level, double measure);

/// Chooses the children of DistanceLODs by where heads are, and says so in `Node::levels`.
///
/// A view with less detail (common/wall/Detail.h) sees everything as if it were as many times as far away.
/// Distances are from a head (between the eyes) to the core's center, in the world. Sizes are what the core's sphere
/// has across on the finest of the user's screens, as if it stood straight before the eye; a head within it sees the
/// finest level. Only users that tiles are drawn for count; of those that share a byte the one who sees most. A node
/// that hangs nowhere is left as it is.
///
/// What the server itself hangs into the scene, handles of several sizes, it leaves alone.
///
/// Follows the scene: watches the nodes that bear the core and those above them. A list that touches none of these
/// costs a look-up per entry; a frame costs what has moved, all of them where a head has. Without such cores nothing.
/// Not thread-safe.
class LevelChoice {
public:
    /// Of the edits that carry what is chosen; nobody waits for them.
    static constexpr std::uint64_t kTicket = ~std::uint64_t{0};

    explicit LevelChoice(const Wall& wall);

    /// After each list applied to the scene, with that list; null: anything may have changed.
    void update(const Aspect& scene, const ChangeList* list);
    /// What is to be written so that users see what they should. `scene`: as of the last update. What is not applied is
    /// said again.
    [[nodiscard]] ChangeList choose(const Aspect& scene, const View& view);

    /// Nodes with such a core, wherever they hang.
    [[nodiscard]] std::size_t count() const { return bearers_.size(); }
    /// Nodes judged or placed so far: what tests of cost count.
    [[nodiscard]] std::uint64_t work() const { return work_; }

private:
    struct Bearer {
        bool attached = false;
        Vec3d center = Vec3d::Zero();  ///< world
        double radius = 0;             ///< world
    };

    [[nodiscard]] bool noteBearers(const Aspect& scene, const ChangeList& list);
    [[nodiscard]] bool concernsTree(const ChangeList& list) const;
    void watch(const Aspect& scene);
    void placeBelow(ObjectId node);
    void place(const Aspect& scene, ObjectId node, Bearer& bearer);
    [[nodiscard]] std::int64_t levelsOf(const DistanceLOD& lod, const Node& node, const Bearer& bearer) const;

    Lookers lookers_;
    std::unordered_map<ObjectId, Bearer> bearers_;
    std::unordered_map<ObjectId, std::vector<ObjectId>>
        watched_;  ///< bearers and all nodes above them → watched children
    std::unordered_map<ObjectId, std::vector<ObjectId>> nodesOfCore_;  ///< cores of watched nodes
    std::set<ObjectId> stale_;                                         ///< bearers that may stand elsewhere
    std::set<ObjectId> due_;                                           ///< bearers to be judged
    std::uint64_t work_ = 0;
};

}  // namespace tessera
