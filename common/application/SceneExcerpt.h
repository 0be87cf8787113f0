/// Copies of some of the server's objects, for those who do not follow the whole scene.
#pragma once

#include <optional>
#include <unordered_map>
#include <vector>

#include "common/base/Error.h"
#include "common/request/SceneRequests.h"
#include "common/scene/FieldTable.h"

namespace tessera {

/// Objects as they stood when the server told of them. What their references name may be missing. One owner.
class SceneExcerpt {
public:
    SceneExcerpt() = default;
    ~SceneExcerpt();
    SceneExcerpt(SceneExcerpt&& other) noexcept = default;
    SceneExcerpt& operator=(SceneExcerpt&& other) noexcept;

    /// Nodes, in the order of the document; empty where single objects were asked for.
    [[nodiscard]] const std::vector<TreeNode>& nodes() const { return nodes_; }
    /// Nothing where it was not told. Of a node `parent` and `children` are as far as they were told.
    [[nodiscard]] Object find(ObjectId id) const;
    template <typename T>
    [[nodiscard]] const T* get(ObjectId id) const {
        return find(id).as<T>();
    }
    /// Of a node of `nodes`: how many it has, told or not.
    [[nodiscard]] std::uint64_t childCount(ObjectId node) const;
    /// The core of a node that was told, or nothing.
    [[nodiscard]] Object coreOf(ObjectId node) const;
    /// Of an Animation, a Motion or a Movie where a tree of that core's type was asked for: s. Nothing: the server does
    /// not know it (yet).
    [[nodiscard]] std::optional<double> lengthOf(ObjectId core) const;

    /// Adds what an answer holds. kBadInput: it is none of this version's scene.
    [[nodiscard]] Expected<void> add(ByteSpan content);
    /// A page of a tree, behind those before it. What was told already is not told twice: only its fields are as in
    /// this page.
    [[nodiscard]] Expected<void> add(const answer::TreePage& page);

private:
    struct Copy {
        const TypeInfo* type = nullptr;
        void* object = nullptr;
    };
    void clear();

    std::unordered_map<ObjectId, Copy> copies_;
    std::vector<TreeNode> nodes_;
    std::unordered_map<ObjectId, double> lengths_;
    std::unordered_map<ObjectId, std::uint64_t> placed_;  ///< those of nodes_, with the number of their children
};

}  // namespace tessera
