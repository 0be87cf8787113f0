/// A body of smooth faces as collision sees it: subdivision surfaces, NURBS with their trims, and, so that they can be
/// asked together, triangle meshes and convex hulls.
///
/// Kept are the control points, where they belong, and a hierarchy of boxes over the faces; no tessellation, no
/// approximation. Queries make Bézier patches of the faces that they come near to, and halve those (FreeformParts.h).
/// Where a subdivision surface is no polynomial, near irregular vertices, its bound is the hull of the control points
/// of refinement, which it never leaves, as all masks are weights of 0 or more. So every bound is conservative without
/// an error that would have to be added.
///
/// Any number of threads may read a shape, and ask pairs that it is in, while nobody moves it. Shapes of one
/// control mesh share what its topology leads to where one is made of the other (`withPositions`).
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/base/Error.h"
#include "common/freeform/BezierPatch.h"
#include "common/freeform/nurbs/NurbsSurface.h"
#include "common/freeform/subdivision/NeighbourhoodGraph.h"
#include "common/math/Box.h"
#include "server/collision/convex/ConvexHull.h"
#include "server/collision/mesh/TriangleMesh.h"

namespace tessera {

class FreeformShape {
public:
    /// Larger control points are refused: squares of distances have to be numbers.
    static constexpr double kMaxCoordinate = 1e50;

    /// Faces are ptex faces (holes have none). Refused: what SubdivisionTopology refuses, the bilinear scheme, a mesh
    /// without a face that has a surface.
    [[nodiscard]] static Expected<FreeformShape> ofSubdivision(const ControlMesh& mesh);
    /// Faces are the surfaces, by their order; u and v are those of their knots. What is trimmed away is not there.
    [[nodiscard]] static Expected<FreeformShape> ofNurbs(std::vector<NurbsSurface> surfaces);
    /// Faces are the triangles; u and v lead from corner 0 to corners 1 and 2.
    [[nodiscard]] static Expected<FreeformShape> ofTriangles(TriangleMesh mesh);
    /// Solid: what is inside touches. Faces are those of the hull. Refused where it has none (a point, a segment).
    [[nodiscard]] static Expected<FreeformShape> ofHull(ConvexHull hull);

    /// Another body of the same control mesh, its points elsewhere: they share the topology and what is known of its
    /// kinds of neighbourhoods, which is most of what a body takes. Of subdivision surfaces alone. Refused as `move`
    /// refuses; whoever uses either may move or drop it alone.
    [[nodiscard]] Expected<FreeformShape> withPositions(std::span<const Vec3d> positions) const;

    /// New places of all control points of a subdivision surface or vertices of a mesh. Nothing changes where it is
    /// refused: another number, no finite numbers, too large, another kind of shape.
    Expected<void> move(std::span<const Vec3d> positions);
    /// Of some, named in `points`; costs what depends on these and the boxes above.
    Expected<void> move(std::span<const std::uint32_t> points, std::span<const Vec3d> positions);

    /// The same seen from another frame. Refused where its numbers leave the range.
    [[nodiscard]] Expected<FreeformShape> placed(const Affine3d& map) const;

    /// Faces that queries look at: of NURBS their Bézier patches.
    [[nodiscard]] std::size_t faceCount() const { return leafOf_.size(); }
    [[nodiscard]] Box bounds() const { return nodes_.empty() ? Box{} : nodes_.front().box; }
    /// Control points, faces, boxes; without what the topology of a subdivision surface and its kinds of neighbourhoods
    /// take.
    [[nodiscard]] std::size_t memoryBytes() const;
    /// Null for surfaces.
    [[nodiscard]] const ConvexHull* hull() const { return hull_ ? &*hull_ : nullptr; }

    // For the queries of this library.

    /// Of the hierarchy: node 0 is its root, children follow their parent, in pairs.
    struct Node {
        Box box;
        std::uint32_t first = 0;  ///< its first child; of a leaf its face
        bool isLeaf = false;
    };
    [[nodiscard]] const std::vector<Node>& nodes() const { return nodes_; }

    struct Subdivision {
        std::shared_ptr<const SubdivisionTopology> topology;
        std::shared_ptr<NeighbourhoodGraph> graph;  ///< grows while it is asked, by any thread
        std::vector<Vec3d> positions;
        std::vector<std::uint32_t> faces;  ///< the ptex face of each face
    };
    struct NurbsPatch {
        BezierPatch patch;
        ParameterRectangle over;
        std::uint32_t surface = 0;
        bool polynomial = true;
        bool crossed = false;  ///< by a trimming curve
    };
    struct Nurbs {
        std::vector<NurbsSurface> surfaces;
        std::vector<NurbsPatch> patches;
    };
    [[nodiscard]] const std::optional<Subdivision>& subdivision() const { return subdivision_; }
    [[nodiscard]] const std::optional<Nurbs>& nurbs() const { return nurbs_; }
    [[nodiscard]] const TriangleMesh& mesh() const { return mesh_; }
    /// How often it has moved.
    [[nodiscard]] std::uint64_t moves() const { return moves_; }

private:
    FreeformShape() = default;
    [[nodiscard]] Box boxOfFace(std::uint32_t face) const;
    void build(std::size_t faces);
    void divide(std::span<std::uint32_t> faces, std::span<const Box> boxes);
    void refit();
    void refitAbove(std::vector<std::uint32_t> faces);

    std::optional<Subdivision> subdivision_;
    std::optional<Nurbs> nurbs_;
    TriangleMesh mesh_;
    std::optional<ConvexHull> hull_;
    std::vector<Node> nodes_;
    std::vector<std::uint32_t> leafOf_, parents_;
    std::uint64_t moves_ = 0;
};

/// Points whose hull holds the surface of a neighbourhood: of its regular parts the Bézier points, of the irregular
/// rest, after so many refinements, the control points.
void hullOfNeighbourhood(NeighbourhoodGraph& graph, const NeighbourhoodGraph::Node& node, std::span<const Vec3d> points,
                         int levels, std::vector<Vec3d>& hull);
inline constexpr int kHullLevels = 2;

}  // namespace tessera
