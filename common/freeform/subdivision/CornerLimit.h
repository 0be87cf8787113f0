/// Where a subdivision surface passes at a vertex, and its tangents there.
///
/// Halstead, Kass and DeRose 1993 (Catmull-Clark), Hoppe et al. 1994 (Loop), Biermann, Levin and Zorin 2000
/// (boundaries): left eigenvectors of the subdivision matrix. Pure.
#pragma once

#include "common/freeform/subdivision/Refinement.h"

namespace tessera {

/// Three rows over the neighbourhood's points: the point; along the face's edge that leaves the corner; along the one
/// that arrives.
///
/// The tangents are derivatives by the face's parameters where those exist. At a vertex of another valence than the
/// regular one they are 0 or infinite; the rows are then directions of the tangent plane, as long as at a regular
/// vertex with neighbours as far away. At a boundary or crease of more than three faces (Loop: five) what is beside the
/// vertex leans away from its tangent plane in general: the scheme's own defect (Biermann et al.); the rows are those
/// that OpenSubdiv takes, along and across the crease. At a fixed corner of more than one face the surface has no
/// tangent plane; the rows are its edges, as OpenSubdiv has it.
struct CornerLimit {
    SparseRows rows;
};

/// No sharpness is left to run out at the corner, and all faces around it are of the regular size.
[[nodiscard]] bool isSettled(const TaggedMesh& neighbourhood, std::uint32_t corner, SubdivisionScheme scheme);

/// A single infinitely sharp edge ends at the corner: no formula is known.
[[nodiscard]] bool isDart(const TaggedMesh& neighbourhood, std::uint32_t corner);

/// Of a settled corner; of a dart as if the edge were smooth.
[[nodiscard]] CornerLimit cornerLimitOf(const TaggedMesh& neighbourhood, std::uint32_t corner,
                                        SubdivisionScheme scheme);

}  // namespace tessera
