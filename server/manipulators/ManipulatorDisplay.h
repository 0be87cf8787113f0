/// Manipulators as nodes of the scene, like everything that is seen.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <unordered_set>
#include <vector>

#include "common/base/Blob.h"
#include "common/change/ChangeList.h"
#include "common/scene/Aspect.h"
#include "server/manipulators/HandleFrame.h"

namespace tessera {

/// Handles as somebody sees them.
struct HandleSight {
    HandleFrame frame;
    Handles handles;
};

/// A manipulator as it stands in a scene. What all see, or the first users: frame and handles.
struct PlacedManipulator : HandleSight {
    ObjectId core;
    ObjectId node;  ///< the first that bears it
    MovedCore moved;
    std::vector<HandleSight> others;  ///< what the next users see, where each sees them of another size; see sightsOf

    [[nodiscard]] std::size_t sights() const { return others.size() + 1; }
    [[nodiscard]] const HandleSight& seenBy(std::size_t user) const {
        return user % sights() == 0 ? *this : others[user % sights() - 1];
    }
};

/// Keeps below each node that bears a Manipulator one child, "handles", as long as the manipulator has something to
/// move:
///
///     the manipulator's node
///       handles   InverseTransform: whatever is above, from here on it is the world
///         turn    Transform ┐ together any affine map: the frame of the handles (HandleFrame.h)
///           turn  Transform ┘
///             pieces   CollisionObject without layers: nobody's obstacle
///               piece  Transform, one for each piece that is shown
///                 shape   Geometry of a fixed array, with a material of its handle and colour
///
/// Where users see them of different sizes, a node "users" (a DistanceLOD, whose Node::levels give each user a child;
/// LevelChoice leaves it alone) is between, and each child of it has such pieces.
///
/// So handles are hidden with the manipulator's node, go with it, and belong to no history: the lists are nobody's
/// edits. Nothing is remembered of them. Their top says what it is (Node::ofServer), so that undo and a server that
/// goes on find them; what is not as it should be is taken away and made anew in the next frame, and what else hangs
/// below the node is left alone. They go when their node bears no Manipulator any more. Files and copies leave them out
/// (common/scene/ServerNodes.h). Pieces of one handle and one colour have one material, which stays while handles are
/// held: then its values change.
///
/// Only values of Transforms travel while a target moves. A frame without a list costs nothing; one with a list costs
/// each manipulator a look at its nodes; what its target shows is looked at only where that may have changed. Not
/// thread-safe.
class ManipulatorDisplay {
public:
    /// After each list applied to the scene, with that list; null: anything may have changed.
    void sceneChanged(const Aspect& scene, const ChangeList* list);

    /// What is missing in the scene; empty where nothing is. New objects carry placeholders. Where it is refused, it is
    /// said again after the next change.
    [[nodiscard]] ChangeList update(const Aspect& scene);

    /// The way handles go that stand below nodes which the list destroys, and which the list does not know.
    [[nodiscard]] ChangeList inTheWayOf(const Aspect& scene, const ChangeList& list) const;

    /// Nodes that bear a manipulator, and that; ascending.
    [[nodiscard]] const std::map<ObjectId, ObjectId>& bearers() const { return bearers_; }
    /// Those that somebody can take hold of, ascending by node.
    [[nodiscard]] std::vector<PlacedManipulator> placed(const Aspect& scene);
    [[nodiscard]] std::optional<PlacedManipulator> place(const Aspect& scene, ObjectId node);
    /// Where its handles stand, in the world; makes none. Nothing where `place` gives nothing.
    [[nodiscard]] std::optional<Vec3d> originOf(const Aspect& scene, ObjectId node);

    /// All arrays that handles ever name.
    [[nodiscard]] static std::vector<Blob> blobs();

private:
    struct Content {
        MovedCore of;  ///< for its node alone
        Box box;
        std::unordered_set<ObjectId> cores;  ///< below it
    };
    /// A manipulator, what it moves, and of each sight the frame.
    struct Stand {
        const Manipulator* manipulator = nullptr;
        MovedCore moved;
        std::vector<HandleFrame> frames;
    };
    [[nodiscard]] std::optional<Stand> standOf(const Aspect& scene, ObjectId node);
    const Box& contentOf(const Aspect& scene, ObjectId node, const MovedCore& moved);
    void noteNode(const Aspect& scene, ObjectId node);
    void forgetContents(const ChangeList& list);

    std::map<ObjectId, ObjectId> bearers_;  ///< nodes that bear a Manipulator → that
    std::set<ObjectId> left_;               ///< nodes that bear none any more: their handles go
    std::map<ObjectId, Content> contents_;  ///< by bearer
    bool stale_ = true;
};

}  // namespace tessera
