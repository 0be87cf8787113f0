/// Indexed triangles, lines, or points that are balls of one radius.
#pragma once

#include "common/cores/ShippedTypes.h"
#include "common/field/Field.h"

namespace tessera {

/// All arrays are blobs; optional ones may be empty. `common/geometry/Mesh.h` checks and views them.
struct Geometry {
    static constexpr ObjectType kType{4};
    static constexpr double kThinnestLinePx = 0.1, kWidestLinePx = 64;
    static constexpr std::int64_t kTriangles = 0, kPoints = 1, kLines = 2, kLineStrip = 3, kLineLoop = 4,
                                  kTriangleStrip = 5, kTriangleFan = 6, kQuads = 7, kQuadStrip = 8, kPolygons = 9;
    Blob positions;  ///< float[3] per vertex
    Blob normals;    ///< float[3] per vertex, unit length; empty: faceted
    Blob colors;     ///< uint8[4] per vertex, sRGB + alpha, multiplied with the material; empty: white
    Blob texcoords;  ///< float[2] per vertex, origin at the image's upper left as in glTF; empty: none
    /// uint32[3] per triangle, counter-clockwise seen from outside; uint32[2] per line; none of points; of the other
    /// primitives uint32 per vertex. Empty: the vertices as they stand.
    Blob indices;
    ObjectId material;  ///< a Material; none: the default material
    /// kPoints: each vertex is a point, shaded by its normal where there are some, else as a ball. kLines: drawn in the
    /// base colour (image and vertex colours too), whatever the light; nobody picks them or collides with them.
    std::int64_t primitive = kTriangles;
    /// Of each point, in the geometry's own coordinates. 0: unknown; they are shown with `shownRadius` of
    /// common/geometry/Points.h.
    double pointRadius = 0;
    float lineWidth = 1;  ///< of lines: pixels of the screen
    Blob texcoords1;      ///< as texcoords: a second set, for images that ask for it
    /// uint32 per strip, loop, fan or polygon: how many vertices each takes, one after the other. Empty: all are one;
    /// of triangles, lines, quads and points it says nothing. Polygons are flat, concave ones too, and each is one
    /// outline that does not cross itself.
    Blob lengths;
    /// float[4] per vertex: where u grows, of unit length; w is 1 or -1, so that cross(normal, xyz) · w goes against v.
    /// Empty: hosts make them where a normal map needs some (common/geometry/TangentSpace.h).
    Blob tangents;
};
template <>
inline constexpr auto kSaid<Geometry> = []<typename T>(Describing<T>) {
    return describe("Geometry", field<&T::positions>(1, "positions").floats(3).affects(Effect::kShape),
                    field<&T::normals>(2, "normals").floats(3).affects(Effect::kLook),
                    field<&T::colors>(3, "colors").integers(4, 1).affects(Effect::kLook),
                    field<&T::texcoords>(4, "texcoords").floats(2).affects(Effect::kLook),
                    field<&T::indices>(5, "indices").integers(1, 4).affects(Effect::kShape),
                    field<&T::material>(6, "material").to(typeOf<Material>()).affects(Effect::kLook),
                    field<&T::primitive>(7, "primitive")
                        .oneOf({{Geometry::kTriangles, "triangles"},
                                {Geometry::kPoints, "points"},
                                {Geometry::kLines, "lines"},
                                {Geometry::kLineStrip, "line-strips"},
                                {Geometry::kLineLoop, "line-loops"},
                                {Geometry::kTriangleStrip, "triangle-strips"},
                                {Geometry::kTriangleFan, "triangle-fans"},
                                {Geometry::kQuads, "quads"},
                                {Geometry::kQuadStrip, "quad-strips"},
                                {Geometry::kPolygons, "polygons"}})
                        .affects(Effect::kShape),
                    field<&T::pointRadius>(8, "pointRadius").between(0, 1e12).affects(Effect::kShape),
                    field<&T::texcoords1>(9, "texcoords1").floats(2).affects(Effect::kLook),
                    field<&T::lineWidth>(10, "lineWidth")
                        .unit(Unit::kPixel)
                        .between(Geometry::kThinnestLinePx, Geometry::kWidestLinePx)
                        .affects(Effect::kLook),
                    field<&T::lengths>(11, "lengths").integers(1, 4).affects(Effect::kShape),
                    field<&T::tangents>(12, "tangents").floats(4).affects(Effect::kLook));
};

}  // namespace tessera
