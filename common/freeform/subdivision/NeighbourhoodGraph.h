/// What faces' surfaces depend on, and what refinement makes of that, each kind worked out once.
///
/// Two faces whose neighbourhoods are equal share a node. Near a vertex of another valence than the regular one refinement soon leads to
/// where it came from, so the graph of nodes is finite, and however near a point lies, no topology is worked out anew. Sharpness that
/// runs out makes at most ten more of a kind. Positions have no part in it.
/// Not thread-safe: one each thread. Nodes live until `shrink`.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <unordered_map>

#include "common/freeform/subdivision/ApproximatePatch.h"
#include "common/freeform/subdivision/CornerLimit.h"
#include "common/freeform/subdivision/Refinement.h"
#include "common/freeform/subdivision/RegularPatch.h"

namespace tessera {

class NeighbourhoodGraph {
public:
    struct Node;
    struct Child {
        const Node* node = nullptr;
        SparseRows points;  ///< the child's points by the node's
    };
    struct Node {
        TaggedMesh mesh;
        std::optional<SparseRows> spline;  ///< of a regular patch: its points
        std::vector<std::optional<Child>> children;
        std::vector<std::optional<CornerLimit>> corners;
        std::optional<std::optional<SparseRows>> approximation;
        [[nodiscard]] std::size_t pointCount() const { return mesh.vertexCount(); }
        [[nodiscard]] std::uint32_t faceSize() const { return mesh.faceSize(0); }
    };
    struct Face {
        Node* node = nullptr;
        std::vector<std::uint32_t> points;  ///< control points
    };

    /// The topology has to live as long. Not of the bilinear scheme.
    explicit NeighbourhoodGraph(const SubdivisionTopology& topology);

    [[nodiscard]] const SubdivisionTopology& topology() const { return topology_; }
    [[nodiscard]] const RefinementRules& rules() const { return rules_; }
    const Face& faceOf(std::uint32_t face);
    const Child& childOf(const Node& node, std::uint32_t child);
    /// What the surface is at a corner. Of a node whose sharpness there has not run out, by its descendants.
    const CornerLimit& limitAt(const Node& node, std::uint32_t corner);

    /// ApproximatePatch.h; null where there is none.
    const SparseRows* approximationOf(const Node& node);

    [[nodiscard]] std::size_t nodeCount() const { return nodes_.size(); }
    /// Forgets everything once more than `bytes` are held. Nodes and faces that were asked for before are gone then.
    void shrink(std::size_t bytes = std::size_t{1} << 28);

private:
    Node* nodeOf(TaggedMesh mesh);
    Node& own(const Node& node) { return const_cast<Node&>(node); }  // all nodes are this graph's
    CornerLimit dartLimit(const Node& node, std::uint32_t corner);

    const SubdivisionTopology& topology_;
    RefinementRules rules_;
    std::unordered_map<std::string, std::unique_ptr<Node>> nodes_;
    std::unordered_map<std::uint32_t, Face> faces_;
    std::size_t bytes_ = 0;
};

}  // namespace tessera
