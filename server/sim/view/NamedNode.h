/// The node at a path, followed through the scene's lists.
#pragma once

#include <cstdint>
#include <string>
#include <unordered_set>

#include "common/scene/Aspect.h"

namespace tessera {

/// What findNode says of the scene at any time. A list costs a look-up per entry; only where a node came, went, moved
/// or was renamed that the path may speak of is it looked for anew. Not thread-safe.
class NamedNode {
public:
    /// `path`: as findNode takes it.
    explicit NamedNode(std::string path) : path_(std::move(path)) {}

    /// After each list applied to the scene, with that list; null: anything may have changed. Before the first question
    /// once with null.
    void update(const Aspect& scene, const ChangeList* list);

    [[nodiscard]] const Expected<ObjectId>& node() const { return node_; }
    [[nodiscard]] const std::string& path() const { return path_; }
    /// How often it was looked for.
    [[nodiscard]] std::uint64_t searches() const { return searches_; }

private:
    void find(const Aspect& scene);
    [[nodiscard]] bool concerns(const Aspect& scene, const ChangeList& list) const;
    /// Whether a step of the path may mean a node of this name. May say so wrongly, never the other way round.
    [[nodiscard]] bool mayMean(const std::string& name) const;

    std::string path_;
    Expected<ObjectId> node_ = ObjectId();
    /// All whose names the path may mean, among the children of the nodes on the way: an earlier one of the same name
    /// counts.
    std::unordered_set<ObjectId> namesakes_;
    std::uint64_t searches_ = 0;
};

}  // namespace tessera
