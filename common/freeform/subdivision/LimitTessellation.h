/// Triangles whose vertices lie on a subdivision surface, for any positions of its control points.
///
/// Every edge of a quadrilateral (Loop: triangle) is cut into 2^level parts, each half of another polygon's edge into half as many, so
/// neighbours meet. A vertex that faces share is evaluated once, and where sharp edges part its normals, its copies have the bytes of
/// one position: the triangles leave no gap that the surface does not have. What depends on topology alone is worked out when this is
/// built: rows of weights, each kind of neighbourhood once (CornerLimit.h, RegularPatch.h, refinement between), so that points of moved
/// control points cost sums only. Immutable; any thread. The same bytes come of the same input, in whatever steps they were asked for.
#pragma once

#include <memory>

#include "common/freeform/subdivision/NeighbourhoodGraph.h"

namespace tessera {

class LimitTessellation {
public:
    static constexpr int kFinestLevel = 6;

    struct Limits {
        std::size_t mostTriangles = std::size_t{1} << 22;
        std::size_t mostWeights = std::size_t{1} << 25;  ///< numbers of 8 bytes, over all kinds of irregular neighbourhoods
    };

    /// `mesh`: its positions count, where they are does not. Whatever SubdivisionTopology refuses; kLimit: more triangles or weights
    /// than may be; kBadInput: a level that is not from 0 to kFinestLevel.
    [[nodiscard]] static Expected<std::shared_ptr<const LimitTessellation>> build(const ControlMesh& mesh, int level, const Limits& limits);
    [[nodiscard]] static Expected<std::shared_ptr<const LimitTessellation>> build(const ControlMesh& mesh, int level) { return build(mesh, level, Limits()); }

    [[nodiscard]] const SubdivisionTopology& topology() const { return topology_; }
    /// Of the level that was asked for; at least 1 where there are polygons of other sizes.
    [[nodiscard]] int level() const { return level_; }
    [[nodiscard]] std::size_t vertexCount() const { return vertexCount_; }
    /// Three a triangle, counter-clockwise as the control mesh is. Holes have none.
    [[nodiscard]] const std::vector<std::uint32_t>& indices() const { return indices_; }
    [[nodiscard]] std::size_t bytes() const;

    /// xyz of each vertex, and its unit normal: where there is no tangent plane, that of the triangles beside it; (0, 0, 1) where
    /// these are points. Where the tangents of faces that share a vertex differ all the same (the end of a sharp edge; parts of one
    /// polygon in the bilinear scheme), those of one of them. `points`: xyz of each control point, finite. `positions`, `normals`: three numbers a vertex.
    void evaluate(std::span<const float> points, std::span<float> positions, std::span<float> normals) const;

    struct Range {
        std::size_t begin = 0, end = 0;  ///< vertices
    };
    /// The same where those are what they were, but for what depends on these control points: that alone is evaluated.
    /// Returns where vertices may have changed.
    [[nodiscard]] Range update(std::span<const std::uint32_t> moved, std::span<const float> points, std::span<float> positions, std::span<float> normals) const;

    /// Of the triangles of `coarser`, at most this one's level, which is 2 or more: about how far the limit surface is from them, rather too
    /// much than too little. Measured where vertices of this one lie between those, across the surface (along what is sharp or a
    /// boundary, in all directions); what is finer than these is taken to fall off as it does where the face is a polynomial,
    /// or slowly, or, within creases that are not yet smooth, not at all. Rounding to floats is not in it. `positions`, `normals`:
    /// as `evaluate` or `update` left them.
    [[nodiscard]] double deviation(std::span<const float> positions, std::span<const float> normals, int coarser) const;

private:
    /// A face's own grid: vertex (i, j) is number i + j · (n + 1), or the same without what lies beyond i + j = n.
    struct Owned {
        std::uint32_t sample = 0, vertex = 0;
    };
    struct Copy {
        std::uint32_t to = 0, from = 0;  ///< `to` has the position of `from`
    };
    /// Weights of point and two tangents, for each sample of a grid, by the points of a neighbourhood.
    struct Table {
        std::size_t columns = 0;
        std::vector<double> weights;  ///< samples × 3 × columns
    };
    struct Face {
        const SparseRows* spline = nullptr;  ///< of a regular one: its table is the spline's own
        const Table* table = nullptr;        ///< null: the bicubic's tensor product
        std::uint32_t pointsBegin = 0, pointsEnd = 0;
        std::uint32_t ownedBegin = 0, ownedEnd = 0;
        std::uint32_t segments = 1;
        float sharpest = 0;      ///< of what is not infinitely sharp at its vertices
        std::uint32_t most = 0;  ///< edges at one of its vertices
        std::uint8_t rims = 0;   ///< bits, by side of its grid (j = 0, i or i + j = n, j = n, i = 0): sharp, or a boundary
    };
    struct Scratch {
        std::vector<Vec3d> points, spline, grid, normals;
    };
    class Builder;

    explicit LimitTessellation(SubdivisionTopology topology) : topology_(std::move(topology)) {}
    void evaluateFace(const Face& face, std::span<const float> points, Scratch& scratch, std::span<float> positions, std::span<float> normals) const;
    void copyPositions(std::span<float> positions) const;
    [[nodiscard]] bool triangular() const { return topology_.scheme() == SubdivisionScheme::kLoop; }

    SubdivisionTopology topology_;
    int level_ = 0;
    std::size_t vertexCount_ = 0;
    std::vector<std::uint32_t> indices_;
    std::vector<Face> faces_;  ///< by ptex number; of one without surface, without samples
    std::vector<std::uint32_t> points_;
    std::vector<Owned> owned_;
    std::vector<Copy> copies_;
    std::vector<std::unique_ptr<const Table>> tables_;
    std::vector<std::unique_ptr<const SparseRows>> splines_;
};

}  // namespace tessera
