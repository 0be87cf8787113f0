/// Motions, interests, collision objects, lights and manipulators name nodes of their file.
#pragma once

#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "server/import/PlacedNodes.h"

namespace tessera {

/// Names that are looked up once everything has its place, and what follows of them: who drives what handles move.
/// Not thread-safe.
class NodeReferences {
public:
    explicit NodeReferences(SceneDraft& draft) : draft_(draft) {}

    /// What the content of a node names. `core`: of that content. `from`: the node that bears it.
    void take(const LoadedFile& file, const proto::scene::Node& node, ObjectId core, PlacedNode* from, PlacedNode* top);
    [[nodiscard]] std::size_t taken() const { return pending_.size(); }
    /// Looks up all that came after the first so many, and writes them into the draft. Fails in the words of who names.
    Expected<void> resolve(std::size_t after);

    /// A core that something moves by itself ("a motion").
    void isDriven(ObjectId core, std::string_view by) { driven_.emplace(core, by); }
    /// Of manipulators of what a motion or an animation drives: they wait until that is paused.
    void noteDriven();

private:
    enum class Kind : std::uint8_t {
        kMotionTarget,
        kInterestObject,
        kInterestAgainst,
        kCollisionNode,
        kBeacon,
        kScope,
        kManipulatorTarget
    };
    struct Pending {
        Kind kind;
        ObjectId core;
        PlacedNode* from;
        PlacedNode* top;
        std::string name;
        std::string where;     ///< file:line:column
        bool free = false;     ///< a collision object with a mass; a manipulator of a light
        ObjectType type = {};  ///< of a light
    };
    struct Handle {
        ObjectId moved;     ///< the core that it writes
        std::string where;  ///< file:line:column
    };
    Expected<void> resolve(const Pending& ref);
    void noteTwins(const Pending& ref, PlacedNode& found);
    void noteUnfree(const Pending& ref, const PlacedNode& body);

    SceneDraft& draft_;
    std::vector<Pending> pending_;
    std::map<ObjectId, std::string_view> driven_;
    std::vector<Handle> handles_;
    std::set<std::string> saidOfTwins_;  ///< a place that is repeated is told once
};

}  // namespace tessera
