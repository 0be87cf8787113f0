/// One thread's, or one host's, own copy of the scene.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "common/base/Error.h"
#include "common/change/ChangeList.h"
#include "common/cores/Node.h"
#include "common/scene/FieldTable.h"

namespace tessera {

class ObjectTable;

struct SceneLimits {
    std::size_t maxObjects = 4'000'000;
    std::size_t maxChildren = 1'000'000;
    std::size_t maxDepth = 256;       ///< nodes from the root
    std::size_t maxTextBytes = 4096;  ///< one text value
    std::size_t maxRefs = 65'536;     ///< one list of references
};

/// Holds all objects by id. Changed by applying change lists and in no other way. One thread owns it; nothing in it is
/// shared with others but immutable blobs.
///
/// A list is checked against the scene before anything is touched: a refused list leaves aspect and hash as they were.
/// Checked: ids exist (creations: do not), types and kinds agree, numbers are finite, a rotation is not zero, the tree
/// has no cycle and stays within the limits, refs lead to the right type, nothing in use is destroyed (a node with
/// children or a parent, an object that a ref names), the root stays. What counts is the scene that the list leaves
/// behind, whatever the tree is like in between: so the way back from a list fits the scene that it has left
/// (tests/property).
class Aspect {
public:
    explicit Aspect(SceneLimits limits = {});
    ~Aspect();
    Aspect(Aspect&&) noexcept;
    Aspect& operator=(Aspect&&) noexcept;

    /// Cost is proportional to the list.
    [[nodiscard]] Expected<void> apply(const ChangeList& list);
    /// Also returns the list that leads back. Its creations bring back old ids.
    [[nodiscard]] Expected<ChangeList> applyWithInverse(const ChangeList& list);

    /// Nothing where there is no such object. What is found holds until the next apply.
    [[nodiscard]] Object find(ObjectId id) const;
    template <typename T>
    [[nodiscard]] const T* get(ObjectId id) const {
        return find(id).as<T>();
    }
    [[nodiscard]] const Node& root() const { return *get<Node>(kRootNode); }
    /// The core of a node as T, or null.
    template <typename T>
    [[nodiscard]] const T* coreOf(const Node& node) const {
        return node.core ? get<T>(node.core) : nullptr;
    }
    /// How many refs name this object (a node's core, a geometry's material, …).
    [[nodiscard]] std::size_t useCount(ObjectId id) const;
    [[nodiscard]] std::size_t objectCount() const;
    /// All ids in ascending order.
    [[nodiscard]] std::vector<ObjectId> ids() const;
    /// The lowest id that has never been used here.
    [[nodiscard]] std::uint64_t nextFreeId() const;

    /// Depends on the present objects, fields and tree only, not on how they came to be. Kept up to date by apply.
    [[nodiscard]] StateHash stateHash() const;
    /// The tree under the state hash, to find the first object that differs between two hosts.
    /// Leaf i covers the ids [i * kIdsPerLeaf, (i+1) * kIdsPerLeaf).
    static constexpr std::uint64_t kIdsPerLeaf = 1024;
    struct LeafHash {
        std::uint64_t leaf = 0;
        std::uint64_t hash = 0;
        bool operator==(const LeafHash&) const = default;
    };
    [[nodiscard]] std::vector<LeafHash> leafHashes() const;
    struct ObjectHash {
        ObjectId id;
        std::uint64_t hash = 0;
        bool operator==(const ObjectHash&) const = default;
    };
    [[nodiscard]] std::vector<ObjectHash> objectHashes(std::uint64_t leaf) const;

private:
    friend ChangeList snapshot(const Aspect& aspect);
    friend class Action;  // these find nodes and cores where they come in runs
    friend class SiblingNames;
    friend class WorldTransforms;
    struct Impl;
    [[nodiscard]] const ObjectTable& table() const;
    std::unique_ptr<Impl> impl_;
};

/// Names the arrays that the list's ranges lead to, for a committer: a proposal does not know them. Refused where a
/// range lies outside its array, or where the array is not here and its name is not said.
[[nodiscard]] Expected<void> resolveRanges(const Aspect& aspect, ChangeList& list);

/// The list that leads from the empty scene to this one, next free id included.
[[nodiscard]] ChangeList snapshot(const Aspect& aspect);

/// All blobs that the scene's fields name (each once), resident or not.
[[nodiscard]] std::vector<Blob> blobsOf(const ChangeList& list);

/// The node at a path such as "/hall/crane" (names from the root's children down; "name[2]" picks the third of equal
/// names), or "#17" by id. kNotFound says which step failed and what is there instead.
[[nodiscard]] Expected<ObjectId> findNode(const Aspect& aspect, std::string_view path);
/// The same for many paths while the scene stays as it is: the children of a node that is asked about again are looked
/// at once in all.
class NodeFinder {
public:
    /// `maxLooks`: of nodes, in all.
    explicit NodeFinder(const Aspect& aspect, std::size_t maxLooks = ~std::size_t{0})
        : aspect_(aspect), looks_(maxLooks) {}
    [[nodiscard]] Expected<ObjectId> find(std::string_view path);
    /// Counts what somebody else looks at, too. False: that would be too much.
    bool look(std::size_t nodes);
    /// The nodes above this one; with `siblings` all that `pathsOf` looks at for it.
    bool lookAbove(ObjectId node, bool siblings);
    /// Too much was to be looked at: what was found last does not count.
    [[nodiscard]] bool exhausted() const { return exhausted_; }

private:
    struct Children {
        bool listed = false;
        std::unordered_map<std::string_view, std::vector<ObjectId>> byName;
    };
    const Aspect& aspect_;
    std::unordered_map<ObjectId, Children> known_;
    std::size_t looks_;  ///< that are left
    bool exhausted_ = false;
};
/// The path of a node for people.
[[nodiscard]] std::string pathOf(const Aspect& aspect, ObjectId node);
/// The same of many; what lies above several of them is looked at once.
[[nodiscard]] std::vector<std::string> pathsOf(const Aspect& aspect, std::span<const ObjectId> nodes);
/// How each of a parent's children, by name and in order, stands in a path: "crane", or "row[2]" among equal names.
/// Empty where no path can say it.
[[nodiscard]] std::vector<std::string> stepsOf(std::span<const std::string_view> names);

}  // namespace tessera
