/// A mesh that joints and morph targets deform.
#pragma once

#include "common/cores/ShippedTypes.h"
#include "common/field/Field.h"

namespace tessera {

/// Linear blend skinning and morph targets as glTF 2.0 defines them. What travels while it moves are `pose` and
/// `weights`; every host, and the server for collisions and picks, makes the same vertices of them (`common/drawable`).
struct Skin {
    static constexpr ObjectType kType{26};
    /// float[12] per joint: node_T_bind, row by row: where a vertex at rest goes that follows this joint alone, in the
    /// coordinates of the node that bears the skin. With `joints` the server writes it whenever they move. Empty: at
    /// rest.
    Blob pose;
    Blob weights;  ///< float per morph target; empty: all 0
    // The mesh at rest: triangles, as Geometry has them.
    Blob positions;
    Blob normals;
    Blob colors;
    Blob texcoords;
    Blob indices;
    Blob texcoords1;
    Blob jointIndices;    ///< uint16[4] per vertex, into the joints; empty: no joint moves it
    Blob jointWeights;    ///< float[4] per vertex, not below 0; what they sum up to is made 1
    Blob morphPositions;  ///< float[3] per target and vertex, target after target: what is added to positions
    Blob morphNormals;    ///< the same of normals; empty: normals are as at rest before joints turn them
    RefList joints;       ///< Nodes; empty: an application writes `pose` itself
    Blob inverseBinds;    ///< float[12] per joint: joint_T_bind, row by row; empty: identity
    ObjectId material;    ///< a Material; none: the default material
    Blob tangents;        ///< as Geometry has them; they move with the surface
    Blob morphTangents;   ///< float[3] per target and vertex: what is added to the tangents' xyz
};
template <>
inline constexpr auto kSaid<Skin> = []<typename T>(Describing<T>) {
    return describe("Skin", field<&T::pose>(1, "pose").floats(12).affects(Effect::kShape),
                    field<&T::weights>(2, "weights").floats(1).affects(Effect::kShape),
                    field<&T::positions>(3, "positions").floats(3).affects(Effect::kShape),
                    field<&T::normals>(4, "normals").floats(3).affects(Effect::kLook),
                    field<&T::colors>(5, "colors").integers(4, 1).affects(Effect::kLook),
                    field<&T::texcoords>(6, "texcoords").floats(2).affects(Effect::kLook),
                    field<&T::indices>(7, "indices").integers(1, 4).affects(Effect::kShape),
                    field<&T::texcoords1>(8, "texcoords1").floats(2).affects(Effect::kLook),
                    field<&T::jointIndices>(9, "jointIndices").integers(4, 2).affects(Effect::kShape),
                    field<&T::jointWeights>(10, "jointWeights").floats(4).affects(Effect::kShape),
                    field<&T::morphPositions>(11, "morphPositions").floats(3).affects(Effect::kShape),
                    field<&T::morphNormals>(12, "morphNormals").floats(3).affects(Effect::kShape),
                    field<&T::joints>(13, "joints").to(typeOf<Node>()).affects(Effect::kTime),
                    field<&T::inverseBinds>(14, "inverseBinds").floats(12).affects(Effect::kTime),
                    field<&T::material>(15, "material").to(typeOf<Material>()).affects(Effect::kLook),
                    field<&T::tangents>(16, "tangents").floats(4).affects(Effect::kLook),
                    field<&T::morphTangents>(17, "morphTangents").floats(3).affects(Effect::kShape));
};

}  // namespace tessera
