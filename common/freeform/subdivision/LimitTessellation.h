/// Triangles whose vertices lie on a subdivision surface, for any positions of its control points.
///
/// Each control face has a level of its own: its grid has 2^level segments to an edge of a quadrilateral (Loop:
/// triangle), half as many to each half of another polygon's edge. An edge is cut as the finer of its faces is; the
/// coarser one's outermost triangles have these vertices, too. A vertex that faces share is evaluated once, and where
/// sharp edges part its normals, its copies have the bytes of one position: the triangles leave no gap that the surface
/// does not have. What depends on topology alone is the plan's (LimitPlan.h) and found there by whatever pattern of
/// levels comes later, so that points of moved control points cost sums only. Immutable; any thread. The same bytes
/// come of the same input, in whatever steps they were asked for.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "common/freeform/subdivision/LimitPlan.h"
#include "common/freeform/subdivision/SampleTables.h"

namespace tessera {

class LimitTessellation {
public:
    static constexpr int kFinestLevel = LimitPlan::kFinestLevel;

    struct Limits {
        std::size_t mostTriangles = std::size_t{1} << 22;
        std::size_t mostWeights =
            std::size_t{1} << 25;  ///< numbers of 8 bytes, over all kinds of irregular neighbourhoods that are used
    };

    /// `levels`: one for each control face, at least 1 where there are polygons of other sizes. kLimit: more triangles
    /// or weights than may be; kBadInput: a level that is not from 0 to kFinestLevel.
    [[nodiscard]] static Expected<std::shared_ptr<const LimitTessellation>> build(std::shared_ptr<const LimitPlan> plan,
                                                                                  std::span<const std::uint8_t> levels,
                                                                                  const Limits& limits);
    [[nodiscard]] static Expected<std::shared_ptr<const LimitTessellation>> build(
        std::shared_ptr<const LimitPlan> plan, std::span<const std::uint8_t> levels) {
        return build(std::move(plan), levels, Limits());
    }
    /// Of one level, with a plan of its own. `mesh`: its positions count, where they are does not. Whatever
    /// SubdivisionTopology refuses, too.
    [[nodiscard]] static Expected<std::shared_ptr<const LimitTessellation>> build(const ControlMesh& mesh, int level,
                                                                                  const Limits& limits);
    [[nodiscard]] static Expected<std::shared_ptr<const LimitTessellation>> build(const ControlMesh& mesh, int level) {
        return build(mesh, level, Limits());
    }

    [[nodiscard]] const LimitPlan& plan() const { return *plan_; }
    [[nodiscard]] const SubdivisionTopology& topology() const { return plan_->topology(); }
    /// The finest of any face's.
    [[nodiscard]] int level() const { return level_; }
    [[nodiscard]] std::size_t vertexCount() const { return vertexCount_; }
    /// Three a triangle, counter-clockwise as the control mesh is. Holes have none.
    [[nodiscard]] const std::vector<std::uint32_t>& indices() const { return indices_; }
    /// Without the plan's, which others may share.
    [[nodiscard]] std::size_t bytes() const;

    /// xyz of each vertex, and its unit normal: where there is no tangent plane, that of the triangles beside it; (0,
    /// 0, 1) where these are points. Where the tangents of faces that share a vertex differ all the same (the end of a
    /// sharp edge; parts of one polygon in the bilinear scheme), those of one of them. `points`: xyz of each control
    /// point, finite. `positions`, `normals`: three numbers a vertex.
    void evaluate(std::span<const float> points, std::span<float> positions, std::span<float> normals) const;

    struct Range {
        std::size_t begin = 0, end = 0;  ///< vertices
    };
    /// The same where those are what they were, but for what depends on these control points: that alone is evaluated.
    /// Returns where vertices may have changed.
    [[nodiscard]] Range update(std::span<const std::uint32_t> moved, std::span<const float> points,
                               std::span<float> positions, std::span<float> normals) const;

private:
    /// In a face's own grid: vertex (i, j) is number i + j · (n + 1), or the same without what lies beyond i + j = n.
    struct Owned {
        std::uint32_t sample = 0, vertex = 0;
    };
    /// Of a finer neighbour's places on a side where normals part.
    struct Extra {
        const LimitPlan::Table* table = nullptr;
        std::uint32_t vertex = 0;
        std::uint8_t log2Segments = 0, i = 0, j = 0;  ///< of a grid that fine
    };
    struct Copy {
        std::uint32_t to = 0, from = 0;  ///< `to` has the position of `from`
    };
    struct Face {
        const LimitPlan::Table* table = nullptr;  ///< null: the bicubic's tensor product
        std::uint32_t ownedBegin = 0, ownedEnd = 0, extrasBegin = 0, extrasEnd = 0;
        std::uint32_t segments = 1;
    };
    struct Scratch {
        std::vector<Vec3d> points, spline;
        std::vector<CubicSplineBasis> bases;
    };
    class Builder;
    class FaceSums;

    explicit LimitTessellation(std::shared_ptr<const LimitPlan> plan) : plan_(std::move(plan)) {}
    void evaluateFace(std::size_t ptex, std::span<const float> points, Scratch& scratch, std::span<float> positions,
                      std::span<float> normals) const;
    void copyPositions(std::span<float> positions) const;

    std::shared_ptr<const LimitPlan> plan_;
    int level_ = 0;
    std::size_t vertexCount_ = 0;
    std::vector<std::uint32_t> indices_;
    std::vector<Face> faces_;  ///< by ptex number; of one without surface, without samples
    std::vector<Owned> owned_;
    std::vector<Extra> extras_;
    std::vector<Copy> copies_;
};

}  // namespace tessera
