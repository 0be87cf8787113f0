/// What faces' surfaces depend on, and what refinement makes of that, each kind worked out once.
///
/// Two faces whose neighbourhoods are equal share a node. Near a vertex of another valence than the regular one
/// refinement soon leads to where it came from, so the graph of nodes is finite, and however near a point lies, no
/// topology is worked out anew. Sharpness that runs out makes at most ten more of a kind. Positions have no part in it.
/// Any number of threads may ask at once: what is missing is worked out by whoever misses it, without waiting, and of
/// two that do so at once the first one's stays. `shrink` alone needs the graph for itself. What was returned lives
/// until then.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <vector>

#include "common/freeform/subdivision/ApproximatePatch.h"
#include "common/freeform/subdivision/CornerLimit.h"
#include "common/freeform/subdivision/Refinement.h"
#include "common/freeform/subdivision/RegularPatch.h"

namespace tessera {

class NeighbourhoodGraph {
public:
    /// Made once, read by any thread.
    template <typename T>
    class Once {
    public:
        Once() = default;
        Once(const Once&) = delete;
        Once& operator=(const Once&) = delete;
        ~Once() { delete value_.load(std::memory_order_relaxed); }

        /// Null before it is there.
        [[nodiscard]] const T* get() const { return value_.load(std::memory_order_acquire); }
        /// What is there then: this value, or one that was first.
        const T& offer(std::unique_ptr<const T> value) const {
            const T* first = nullptr;
            if (value_.compare_exchange_strong(first, value.get(), std::memory_order_acq_rel,
                                               std::memory_order_acquire))
                return *value.release();
            return *first;
        }

    private:
        mutable std::atomic<const T*> value_{nullptr};
    };

    struct Node;
    struct Child {
        const Node* node = nullptr;
        SparseRows points;  ///< the child's points by the node's
    };
    struct Node {
        TaggedMesh mesh;
        std::optional<SparseRows> spline;   ///< of a regular patch: its points
        std::vector<Once<Child>> children;  ///< filled by `childOf`
        [[nodiscard]] std::size_t pointCount() const { return mesh.vertexCount(); }
        [[nodiscard]] std::uint32_t faceSize() const { return mesh.faceSize(0); }

    private:
        friend class NeighbourhoodGraph;
        std::vector<Once<CornerLimit>> corners;
        Once<std::optional<SparseRows>> approximation;
        std::uint64_t hash = 0;
        const Node* next = nullptr;  // with a hash that falls into the same place
    };
    struct Face {
        const Node* node = nullptr;
        std::vector<std::uint32_t> points;  ///< control points
    };

    /// The topology has to live as long. Not of the bilinear scheme.
    explicit NeighbourhoodGraph(const SubdivisionTopology& topology);
    ~NeighbourhoodGraph();
    NeighbourhoodGraph(const NeighbourhoodGraph&) = delete;
    NeighbourhoodGraph& operator=(const NeighbourhoodGraph&) = delete;

    [[nodiscard]] const SubdivisionTopology& topology() const { return topology_; }
    [[nodiscard]] const RefinementRules& rules() const { return rules_; }
    const Face& faceOf(std::uint32_t face);
    const Child& childOf(const Node& node, std::uint32_t child);
    /// What the surface is at a corner. Of a node whose sharpness there has not run out, by its descendants.
    const CornerLimit& limitAt(const Node& node, std::uint32_t corner);

    /// ApproximatePatch.h; null where there is none.
    const SparseRows* approximationOf(const Node& node);

    [[nodiscard]] std::size_t nodeCount() const { return nodeCount_.load(std::memory_order_relaxed); }
    /// Forgets everything once more than `bytes` are held. Nodes and faces that were asked for before are gone then. No
    /// other thread may be asking.
    void shrink(std::size_t bytes = std::size_t{1} << 28);

private:
    const Node* nodeOf(TaggedMesh mesh);
    CornerLimit dartLimit(const Node& node, std::uint32_t corner);
    void clear();
    void count(std::size_t bytes) { bytes_.fetch_add(bytes, std::memory_order_relaxed); }

    const SubdivisionTopology& topology_;
    RefinementRules rules_;
    // Lists of nodes that only ever grow, at their heads: by hash.
    std::vector<std::atomic<const Node*>> heads_;
    std::vector<Once<Face>> faces_;
    std::atomic<std::size_t> bytes_{0}, nodeCount_{0};
};

}  // namespace tessera
