/// One refinement of what a face's surface depends on.
///
/// Catmull and Clark 1978; Loop 1987; semi-sharp creases of DeRose, Kass and Truong 1998, as OpenSubdiv has them
/// (Sdc::Scheme, Sdc::Crease): fractional sharpness blends the rules before and after, Chaikin's method evens out along
/// a crease. Pure; any thread.
#pragma once

#include "common/freeform/subdivision/SparseRows.h"
#include "common/freeform/subdivision/SubdivisionTopology.h"

namespace tessera {

/// What of a scheme refinement asks for.
struct RefinementRules {
    SubdivisionScheme scheme = SubdivisionScheme::kCatmullClark;  ///< not kBilinear
    CreaseMethod creaseMethod = CreaseMethod::kUniform;
    TriangleRule triangles = TriangleRule::kPolygon;
};

/// The weight of a smooth vertex's neighbours, each, in Loop's scheme.
[[nodiscard]] double loopNeighbourWeight(std::size_t valence);

struct RefinedNeighbourhood {
    TaggedMesh mesh;                      ///< all that is known of the finer mesh around the face
    SparseRows points;                    ///< its vertices by those of the coarser one
    std::vector<std::uint32_t> children;  ///< the face's parts: by corner, in Loop's scheme then the one in the middle
};

/// `mesh`: as neighbourhoodOf made it. Of a quadrilateral or triangle the child at corner i has that corner as its
/// vertex i; of other polygons as its vertex 0. The middle of a triangle has the middles of edges 1, 2, 0 as its
/// vertices.
[[nodiscard]] RefinedNeighbourhood refine(const TaggedMesh& mesh, const RefinementRules& rules);

}  // namespace tessera
