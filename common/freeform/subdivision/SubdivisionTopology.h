/// What a control mesh says but for where its points are: checked, with edges, sharpness and the numbers of its ptex
/// faces.
///
/// The rules at boundaries and where the mesh is no manifold are OpenSubdiv's (Far, prepareComponentTagsAndSharpness):
/// edges of one face, of more than two, or of two that go the same way are infinitely sharp, and so are vertices where
/// faces do not form one fan, but for those inside a crease along which further faces are attached. Immutable once
/// built; any thread.
#pragma once

#include <unordered_map>

#include "common/base/Error.h"
#include "common/freeform/subdivision/TaggedMesh.h"

namespace tessera {

/// A ptex face: a quadrilateral, or a triangle of Loop's scheme; or what lies around one corner of another polygon.
struct PtexFace {
    std::uint32_t face = 0;
    std::uint32_t corner = kNoIndex;  ///< of the polygon; kNoIndex: all of the face
};

class SubdivisionTopology {
public:
    /// Beyond this a face's neighbourhood costs more than it can be worth.
    static constexpr std::uint32_t kMostValence = 4096;

    /// kBadInput with the first thing that is wrong: an index of no vertex or face, a face of fewer than three vertices
    /// or with one twice (but twice in a row: CollapsedEdges.h), a coordinate or sharpness that is no finite number, a
    /// crease without an edge, Loop with other than triangles. kLimit: a face or vertex of more than kMostValence.
    /// Negative sharpness is 0.
    [[nodiscard]] static Expected<SubdivisionTopology> build(const ControlMesh& mesh);

    [[nodiscard]] SubdivisionScheme scheme() const { return scheme_; }
    [[nodiscard]] CreaseMethod creaseMethod() const { return creaseMethod_; }
    [[nodiscard]] TriangleRule triangles() const { return triangles_; }
    [[nodiscard]] const TaggedMesh& mesh() const { return mesh_; }
    [[nodiscard]] std::size_t controlPointCount() const { return controlPoints_; }
    /// Which control point a vertex of `mesh()` is.
    [[nodiscard]] std::uint32_t controlPointOf(std::uint32_t vertex) const {
        return sources_.empty() ? vertex : sources_[vertex];
    }

    /// Numbered as OpenSubdiv does: in the order of faces, holes too.
    [[nodiscard]] std::size_t ptexFaceCount() const { return firstPtex_.back(); }
    [[nodiscard]] PtexFace ptexFace(std::size_t ptex) const;  ///< below ptexFaceCount
    [[nodiscard]] std::uint32_t firstPtexOf(std::uint32_t face) const { return firstPtex_[face]; }
    /// Holes have none, nor what is at a boundary that is not interpolated (where nobody made its edges infinitely
    /// sharp).
    [[nodiscard]] bool hasSurface(std::uint32_t face) const { return !isHole_[face]; }

    /// The ptex faces whose surface depends on any of these control points, in ascending order; in time proportional to
    /// them.
    [[nodiscard]] std::vector<std::uint32_t> touchedBy(std::span<const std::uint32_t> vertices) const;

private:
    SubdivisionTopology() = default;
    [[nodiscard]] static Expected<SubdivisionTopology> buildPlain(const ControlMesh& mesh);
    void linkVertices();
    void sharpen(BoundaryInterpolation boundary);

    SubdivisionScheme scheme_ = SubdivisionScheme::kCatmullClark;
    CreaseMethod creaseMethod_ = CreaseMethod::kUniform;
    TriangleRule triangles_ = TriangleRule::kPolygon;
    TaggedMesh mesh_;
    std::size_t controlPoints_ = 0;
    std::vector<std::uint32_t> sources_;                            ///< empty: vertices are control points
    std::unordered_multimap<std::uint32_t, std::uint32_t> copies_;  ///< further vertices that are one control point
    std::vector<std::uint32_t> edgeFaceCount_;
    std::vector<bool> edgeIsNonManifold_;
    std::vector<std::uint32_t> vertexFaceBegin_, vertexFaces_;
    std::vector<std::uint32_t> firstPtex_;  ///< faces + 1
    std::vector<bool> isHole_;
};

}  // namespace tessera
