/// What points of a subdivision surface are sums of, wherever the control points are: each face's points, and rows of
/// weights by kind of neighbourhood.
///
/// Faces whose neighbourhoods are alike (NeighbourhoodGraph.h) are of one kind. Rows of a kind are worked out for a
/// grid of so many segments when somebody first asks, and kept: patterns of levels (LimitTessellation.h) that come
/// later find them. Any thread; nobody waits: of two that work out the same the first one's stays.
#pragma once

#include <array>
#include <atomic>
#include <deque>
#include <memory>
#include <optional>

#include "common/freeform/subdivision/NeighbourhoodGraph.h"

namespace tessera {

class LimitPlan {
public:
    static constexpr int kFinestLevel = 6;

    /// Of each sample of a grid (SampleTables.h): point and two tangents, by the points of a neighbourhood, or of a
    /// regular one's spline.
    struct Table {
        std::size_t columns = 0;
        std::vector<double> weights;  ///< samples × 3 × columns
    };
    /// A ptex face; of one without surface nothing is meant.
    struct Face {
        const SparseRows* spline = nullptr;  ///< of a regular one: its points, of which rows are
        std::uint32_t kind = kNoIndex;       ///< of one that is not
        std::uint32_t pointsBegin = 0, pointsEnd = 0;
        float sharpest = 0;      ///< of what is not infinitely sharp at its vertices
        std::uint32_t most = 0;  ///< edges at one of its vertices; where not all around is surface, or one is sharp, as
                                 ///< if both sides had as many
        std::uint8_t rims =
            0;                ///< bits, by side of its grid (j = 0, i or i + j = n, j = n, i = 0): sharp, or a boundary
        bool isPart = false;  ///< of a polygon: half as many segments at each level
    };

    /// `mesh`: its positions count, where they are does not. Whatever SubdivisionTopology refuses.
    [[nodiscard]] static Expected<std::shared_ptr<const LimitPlan>> build(const ControlMesh& mesh);

    [[nodiscard]] const SubdivisionTopology& topology() const { return topology_; }
    [[nodiscard]] bool triangular() const { return topology_.scheme() == SubdivisionScheme::kLoop; }
    /// Some face is cut into parts, and has a level of 1 at least.
    [[nodiscard]] bool hasPolygons() const { return hasPolygons_; }
    [[nodiscard]] const std::vector<Face>& faces() const { return faces_; }  ///< by ptex number
    [[nodiscard]] std::span<const std::uint32_t> pointsOf(const Face& face) const {
        return std::span(points_).subspan(face.pointsBegin, face.pointsEnd - face.pointsBegin);
    }
    /// Numbers that the rows of a kind have for 2^log2Segments segments.
    [[nodiscard]] std::size_t weightsOf(std::uint32_t kind, unsigned log2Segments) const;
    /// The highest level at which all kinds together have no more; -1: none.
    [[nodiscard]] int finestLevel(std::size_t mostWeights) const;
    [[nodiscard]] std::size_t bytes() const;

    /// Finds rows, or works them out, with one graph for all that it is asked for. One thread's.
    class Tables {
    public:
        explicit Tables(const LimitPlan& plan) : plan_(plan) {}
        /// Null: the tensor product of cubic B-splines. Holds as long as the plan.
        const Table* of(const Face& face, unsigned log2Segments);

    private:
        const LimitPlan& plan_;
        std::optional<NeighbourhoodGraph> graph_;
    };

private:
    using MadeOnce = std::array<NeighbourhoodGraph::Once<Table>, kFinestLevel + 1>;
    struct Kind {
        std::uint32_t ptex = 0, columns = 0;  ///< a face of it
        bool isPart = false;
        MadeOnce tables;
    };

    explicit LimitPlan(SubdivisionTopology topology) : topology_(std::move(topology)) {}
    void findKinds();
    void lookAround(const PtexFace& face, Face& here) const;
    const Table* keep(const NeighbourhoodGraph::Once<Table>& place, std::vector<double> weights,
                      std::size_t columns) const;

    SubdivisionTopology topology_;
    bool hasPolygons_ = false;
    std::vector<Face> faces_;
    std::vector<std::uint32_t> points_;
    std::deque<Kind> kinds_;
    std::vector<std::unique_ptr<const SparseRows>> splines_;
    MadeOnce box_;
    mutable std::atomic<std::size_t> tableBytes_{0};
};

}  // namespace tessera
