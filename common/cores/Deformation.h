/// A mesh that a lattice of control points bends: what travels, is undone and animated are its control points.
#pragma once

#include "common/cores/ShippedTypes.h"
#include "common/field/Field.h"

namespace tessera {

/// Freeform deformation (T. W. Sederberg, S. R. Parry 1986; `common/freeform/lattice/Lattice.h`). Whatever of the mesh
/// is within the volume, a box in the mesh's own coordinates, follows the control points; what is outside stays where
/// it is. Drawn, picked and collided with as it stands deformed (`common/drawable`).
struct Deformation {
    static constexpr ObjectType kType{20};
    /// float[3] per control point, in the mesh's own coordinates, those along X first, then Y, then Z. Empty: all at
    /// rest, which is evenly spread over the volume where the degree is 1, and where they move nothing for any degree.
    Blob controlPoints;
    std::int64_t pointsX = 4, pointsY = 4,
                 pointsZ = 4;  ///< how many there are along each axis; at least the degree and one
    std::int64_t degreeX = 3, degreeY = 3,
                 degreeZ = 3;  ///< of the B-splines between them; as many points as that and one: Bernstein's
    Vec3d lower = Vec3d::Constant(-1), upper = Vec3d::Ones();  ///< the volume; above `lower` along each axis
    // The mesh at rest: triangles, as Geometry has them.
    Blob positions;
    Blob normals;
    Blob colors;
    Blob texcoords;
    Blob indices;
    Blob texcoords1;
    ObjectId material;  ///< a Material; none: the default material
    Blob tangents;      ///< as Geometry has them; they move with the surface
};
template <>
inline constexpr auto kSaid<Deformation> = []<typename T>(Describing<T>) {
    return describe("Deformation", field<&T::controlPoints>(1, "controlPoints").floats(3).affects(Effect::kShape),
                    field<&T::pointsX>(2, "pointsX").between(2, 64).affects(Effect::kShape),
                    field<&T::pointsY>(3, "pointsY").between(2, 64).affects(Effect::kShape),
                    field<&T::pointsZ>(4, "pointsZ").between(2, 64).affects(Effect::kShape),
                    field<&T::degreeX>(5, "degreeX").between(1, 10).affects(Effect::kShape),
                    field<&T::degreeY>(6, "degreeY").between(1, 10).affects(Effect::kShape),
                    field<&T::degreeZ>(7, "degreeZ").between(1, 10).affects(Effect::kShape),
                    field<&T::lower>(8, "lower").between(-1e30, 1e30).affects(Effect::kShape),
                    field<&T::upper>(9, "upper").between(-1e30, 1e30).affects(Effect::kShape),
                    field<&T::positions>(10, "positions").floats(3).affects(Effect::kShape),
                    field<&T::normals>(11, "normals").floats(3).affects(Effect::kLook),
                    field<&T::colors>(12, "colors").integers(4, 1).affects(Effect::kLook),
                    field<&T::texcoords>(13, "texcoords").affects(Effect::kLook),
                    field<&T::indices>(14, "indices").integers(1, 4).affects(Effect::kShape),
                    field<&T::texcoords1>(15, "texcoords1").affects(Effect::kLook),
                    field<&T::material>(16, "material").to(typeOf<Material>()).affects(Effect::kLook),
                    field<&T::tangents>(17, "tangents").floats(4).affects(Effect::kLook));
};

}  // namespace tessera
