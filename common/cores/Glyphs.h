/// The same small shape at many places, turned and scaled by data.
#pragma once

#include "common/cores/ShippedTypes.h"
#include "common/field/Field.h"

namespace tessera {

/// Arrows of a flow, boxes and balls of measurements. Arrays have one element per glyph, or are empty. A glyph is lit,
/// casts shadows and lies where its place is: arrows begin there, other shapes have their origin there. Its own turn
/// turns it; where glyphs have none, its Y axis is turned the shortest way to its vector. Nobody collides with glyphs.
/// A ray meets the box around each shape, turned with it: a face that a pick names, divided by 12, is the glyph's
/// number. Transparent ones are not sorted among each other.
struct Glyphs {
    static constexpr ObjectType kType{39};
    static constexpr std::int64_t kArrow = 0, kBox = 1, kBall = 2, kMesh = 3;
    /// What a length or a colour follows: nothing, the length of the glyph's vector, its scalar.
    static constexpr std::int64_t kNothing = 0, kVector = 1, kScalar = 2;
    Blob positions;  ///< float[3]
    Blob vectors;    ///< float[3]; empty: all point along Y
    Blob scalars;    ///< float
    Blob colors;     ///< uint8[4], sRGB + alpha; empty: white
    /// Each is 1 large: arrows from 0 to 1 along Y, boxes and balls around 0. kMesh: as its arrays are.
    std::int64_t shape = kArrow;
    Blob shapePositions;  ///< float[3] per vertex, of kMesh
    Blob shapeNormals;    ///< float[3] per vertex; empty: faceted
    Blob shapeIndices;    ///< uint32[3] per triangle
    double size = 0.1;    ///< in the node's coordinates: what a shape's 1 becomes where the factors below are 1
    /// Factors of its size along its Y axis, and across it. What follows an empty array is 1; below 0 counts as 0, and
    /// such glyphs are not shown.
    std::int64_t lengthBy = kVector, widthBy = kVector;
    std::int64_t colorBy = kScalar;
    /// Colours by that number: uint8[4] per stop, sRGB + alpha, evenly spaced from `low` to `high`, linear in between,
    /// the outermost beyond; multiplied with `colors`. Empty: white.
    Blob transfer;
    double low = 0, high = 1;
    ObjectId material;    ///< its base colour multiplies all colours; its images need shapeTexcoords
    Blob turns;           ///< float[4], a quaternion (x, y, z, w) of any length but 0; empty: vectors turn
    Blob shapeTexcoords;  ///< float[2] per vertex, of kMesh; empty: 0, 0 at all
};
template <>
inline constexpr auto kSaid<Glyphs> = []<typename T>(Describing<T>) {
    return describe(
        "Glyphs", field<&T::positions>(1, "positions").floats(3).affects(Effect::kShape),
        field<&T::vectors>(2, "vectors").floats(3).affects(Effect::kShape),
        field<&T::scalars>(3, "scalars").floats(1).affects(Effect::kShape),
        field<&T::colors>(4, "colors").integers(4, 1).affects(Effect::kShape),
        field<&T::shape>(5, "shape")
            .oneOf({{Glyphs::kArrow, "arrow"}, {Glyphs::kBox, "box"}, {Glyphs::kBall, "ball"}, {Glyphs::kMesh, "mesh"}})
            .affects(Effect::kShape),
        field<&T::shapePositions>(6, "shapePositions").floats(3).affects(Effect::kShape),
        field<&T::shapeNormals>(7, "shapeNormals").floats(3).affects(Effect::kShape),
        field<&T::shapeIndices>(8, "shapeIndices").integers(1, 4).affects(Effect::kShape),
        field<&T::size>(9, "size").unit(Unit::kWorld).between(0, 1e12).affects(Effect::kShape),
        field<&T::lengthBy>(10, "lengthBy")
            .oneOf({{Glyphs::kNothing, "nothing"}, {Glyphs::kVector, "vector"}, {Glyphs::kScalar, "scalar"}})
            .affects(Effect::kShape),
        field<&T::widthBy>(11, "widthBy")
            .oneOf({{Glyphs::kNothing, "nothing"}, {Glyphs::kVector, "vector"}, {Glyphs::kScalar, "scalar"}})
            .affects(Effect::kShape),
        field<&T::colorBy>(12, "colorBy")
            .oneOf({{Glyphs::kNothing, "nothing"}, {Glyphs::kVector, "vector"}, {Glyphs::kScalar, "scalar"}})
            .affects(Effect::kShape),
        field<&T::transfer>(13, "transfer").integers(4, 1).affects(Effect::kShape),
        field<&T::low>(14, "low").between(-1e30, 1e30).affects(Effect::kShape),
        field<&T::high>(15, "high").between(-1e30, 1e30).affects(Effect::kShape),
        field<&T::material>(16, "material").to(typeOf<Material>()).affects(Effect::kLook),
        field<&T::turns>(17, "turns").floats(4).affects(Effect::kShape),
        field<&T::shapeTexcoords>(18, "shapeTexcoords").floats(2).affects(Effect::kShape));
};

}  // namespace tessera
