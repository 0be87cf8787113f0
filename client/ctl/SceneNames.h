/// Where objects that the server speaks of by number stand in its scene.
#pragma once

#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "client/ctl/Answer.h"
#include "common/application/Application.h"

namespace tessera {

/// Asks the server for what it does not know yet. An object whose place cannot be told goes by its number: names are
/// for reading, and no reason to fail.
class SceneNames {
public:
    explicit SceneNames(Application& application) : application_(application) {}

    /// All that is about to be named, at once: each question costs a round trip.
    void learn(std::span<const ObjectId> objects);
    /// The same, with all that is above them.
    void learnWithAncestors(std::span<const ObjectId> nodes);
    /// Which nodes hold these interests; those that are known are not asked for again.
    void learnInterests(std::span<const ObjectId> cores);
    /// What has been learned may have moved: it is asked for again. Where the server no longer answers it still holds.
    void refresh() { fresh_.clear(); }

    /// "/hall/crane", or only the number where the scene has no such node (any more).
    [[nodiscard]] std::string node(ObjectId id) const;
    [[nodiscard]] std::string pair(ObjectId a, ObjectId b) const { return node(a) + " - " + node(b); }
    [[nodiscard]] nlohmann::ordered_json pairJson(ObjectId a, ObjectId b) const;
    /// By the node of the lowest number that holds it; "-": none.
    [[nodiscard]] std::string interest(ObjectId core) const;
    [[nodiscard]] nlohmann::ordered_json interestJson(ObjectId core) const;
    /// Whether the node, or one above it, holds one of these cores. Needs `learnWithAncestors`.
    [[nodiscard]] bool hangsOn(ObjectId node, std::span<const ObjectId> cores) const;

private:
    Application& application_;
    std::map<ObjectId, ObjectInfo> known_;
    std::set<ObjectId> fresh_;              ///< of these: not to be asked for again
    std::map<ObjectId, ObjectId> holders_;  ///< of interests; none: no node holds it
};

/// The nodes that hold one of these cores, in the order of their numbers.
[[nodiscard]] Expected<std::vector<ObjectId>> nodesHolding(Application& application, std::span<const ObjectId> cores);
/// The cores of all interests that stand in the tree, ascending, each with the node of the lowest number that holds it.
[[nodiscard]] Expected<std::map<ObjectId, ObjectId>> interestsOf(Application& application);

}  // namespace tessera
