/// The nodes of a file, planned before any is written: which of ours become nodes of it, and where each stands. As glTF
/// 2.0 has them: what other formats of trees have can say the same.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "common/export/Selection.h"

namespace tessera {

// The front screen of the walls that Tessera ships, in metres, as server/import reads cameras (GltfNodes.cpp).
inline constexpr double kExportWindowHeight = 1.8, kExportWindowCenterY = 1.5, kExportEyeDistance = 2.4;

/// A node of the file: parent_T_node = translation · rotation · scale.
struct PlannedNode {
    std::string name;
    Vec3d translation = Vec3d::Zero();
    Quatd rotation = Quatd::Identity();
    Vec3d scale = Vec3d::Ones();
    std::vector<int> children;
    std::vector<std::size_t> shapes;    ///< in Selection::nodes: the primitives of its mesh
    std::optional<std::size_t> glyphs;  ///< one that is drawn at many places
    std::optional<std::size_t> light, camera;
    std::string lightName, cameraName;
    double yfov = 0;                 ///< of the camera, in radians
    std::optional<std::size_t> own;  ///< in Selection::nodes: what it is made of

    [[nodiscard]] bool isLeaf() const { return children.empty(); }
    /// Whether its one content is its own core's, which then places nothing.
    [[nodiscard]] bool bearsItself(const std::vector<std::size_t>& content) const {
        return content.size() == 1 && bearsItself(std::optional(content.front()));
    }
    [[nodiscard]] bool bearsItself(std::optional<std::size_t> content) const {
        return content && content == own &&
               shapes.size() + std::size_t{glyphs.has_value()} + std::size_t{light.has_value()} +
                       std::size_t{camera.has_value()} ==
                   1;
    }
};

struct PlannedTree {
    std::vector<PlannedNode> nodes;
    std::vector<int> tops;
    /// Of each of the selected nodes the one of the file that its transform is in, and the one that bears what is below
    /// it: two where glTF cannot say the place in one. -1: it is not in the file.
    std::vector<int> moved, inner;
};

/// What our importer makes of a file comes back as the same file: leading children that are named "part 0", "part 1" …
/// and a camera and a light behind them are their parent's mesh, camera and light. `notes` gets what no node can be
/// made of.
[[nodiscard]] PlannedTree planTree(const Aspect& scene, const Selection& selection, ExportNotes& notes);

/// Whether the joints of a Skin are all in the file, so that it can be written as one.
[[nodiscard]] bool hasItsJoints(const SelectedNode& node, const PlannedTree& tree, const Selection& selection);

}  // namespace tessera
