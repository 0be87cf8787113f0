/// Which nodes of a scene a file gets, with what each has from those above it.
#pragma once

#include <string>
#include <unordered_map>
#include <vector>

#include "common/export/ExportNotes.h"
#include "common/scene/Aspect.h"

namespace tessera {

/// Of coordinates and scales: what readers take, ours too.
inline constexpr double kUtmostPlace = 1e15;
/// Whether files can have a node there; else a note says why it is left out, and what helps.
[[nodiscard]] bool canStand(const Affine3d& place, ObjectId node, ExportNotes& notes);

struct SelectedNode {
    static constexpr std::size_t kNone = ~std::size_t{0};
    ObjectId id;
    const Node* node = nullptr;
    Object core;
    std::size_t parent = kNone;  ///< in Selection::nodes
    std::vector<std::size_t> children;
    Affine3d world_T_node = Affine3d::Identity();
    /// Of the groups above, and of the node itself if it is one (common/cores/MaterialGroup.h).
    ObjectId nearestMaterial, overMaterial;
    /// Stands above the selection: a place, and nothing of its own.
    bool isWay = false;

    /// What is drawn here with a material of its own, or with none, has this one.
    [[nodiscard]] ObjectId materialFor(ObjectId own) const {
        return overMaterial ? overMaterial : own ? own : nearestMaterial;
    }
};

/// Nodes in the order of the document, parents first; without the root, what switches hide, all levels of detail but
/// the finest, what a server hangs in for itself (common/scene/ServerNodes.h), and what is below a place that no file
/// can have. They hold as long as the scene stays as it is.
struct Selection {
    std::vector<SelectedNode> nodes;
    std::vector<std::size_t> tops;
    std::unordered_map<ObjectId, std::size_t> byId;

    [[nodiscard]] const SelectedNode* find(ObjectId id) const {
        const auto found = byId.find(id);
        return found == byId.end() ? nullptr : &nodes[found->second];
    }
    /// In the coordinates of the node above.
    [[nodiscard]] Affine3d parent_T_node(const SelectedNode& node) const;
};

/// `under`: the path of a node: it, what is below, and the way down to it. Empty: all. kNotFound as findNode.
[[nodiscard]] Expected<Selection> selectNodes(const Aspect& scene, const std::string& under, ExportNotes& notes);

}  // namespace tessera
