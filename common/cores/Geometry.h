/// Indexed triangles.
#pragma once

#include "common/field/Field.h"
#include "common/cores/Material.h"

namespace tessera {

/// All arrays are blobs; optional ones may be empty. `common/geometry/Mesh.h` checks and views them.
struct Geometry {
    static constexpr ObjectType kType{4};
    Blob positions;     ///< float[3] per vertex
    Blob normals;       ///< float[3] per vertex, unit length; empty: faceted
    Blob colors;        ///< uint8[4] per vertex, sRGB + alpha, multiplied with the material; empty: white
    Blob texcoords;     ///< float[2] per vertex, origin at the image's upper left as in glTF; empty: none
    Blob indices;       ///< uint32[3] per triangle, counter-clockwise seen from outside
    ObjectId material;  ///< a Material; none: the default material
};
template <>
inline constexpr auto kDescription<Geometry> =
    describe("Geometry",
             field<&Geometry::positions>(1, "positions").affects(Effect::kShape),
             field<&Geometry::normals>(2, "normals").affects(Effect::kLook),
             field<&Geometry::colors>(3, "colors").affects(Effect::kLook),
             field<&Geometry::texcoords>(4, "texcoords").affects(Effect::kLook),
             field<&Geometry::indices>(5, "indices").affects(Effect::kShape),
             field<&Geometry::material>(6, "material").to<Material>().affects(Effect::kLook));

}  // namespace tessera
