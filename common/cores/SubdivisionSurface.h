/// A smooth surface that a control mesh stands for: what travels, is undone and animated are its control points.
#pragma once

#include "common/cores/ShippedTypes.h"
#include "common/field/Field.h"

namespace tessera {

/// Words, numbers and defaults are OpenSubdiv's; `common/freeform/subdivision/ControlMesh.h` says what each means and
/// refuses what is no control mesh. Picked and collided with as triangles whose corners lie on the limit surface, the
/// same everywhere (`common/drawable`): how fine these are depends on nobody's eye. A screen draws them as they are, or
/// finer where `screenError` asks for it.
struct SubdivisionSurface {
    static constexpr ObjectType kType{18};
    static constexpr std::int64_t kCatmullClark = 0, kLoop = 1, kBilinear = 2;
    static constexpr std::int64_t kNoBoundary = 0, kEdgeOnly = 1, kEdgeAndCorner = 2;
    static constexpr std::int64_t kUniform = 0, kChaikin = 1;
    static constexpr std::int64_t kPolygon = 0, kSmooth = 1;
    static constexpr std::int64_t kFinestLevel = 6;
    Blob points;           ///< float[3] per control point
    Blob faceSizes;        ///< uint32 per face
    Blob faceVertices;     ///< uint32 per corner of a face, counter-clockwise seen from outside, face after face
    Blob creases;          ///< uint32[2] per crease: the ends of an edge
    Blob creaseSharpness;  ///< float per crease, 10 and above: infinitely sharp; empty: all are
    Blob corners;          ///< uint32 per sharp vertex
    Blob cornerSharpness;  ///< float per corner; empty: all are infinitely sharp
    Blob holes;            ///< uint32 per face that has no surface
    std::int64_t scheme = kCatmullClark;
    std::int64_t boundary = kEdgeOnly;
    std::int64_t creaseMethod = kUniform;
    std::int64_t triangles = kPolygon;  ///< how Catmull-Clark weighs triangles
    std::int64_t level =
        3;  ///< each edge of a face becomes 2^level edges of triangles; at least 1 where other than quadrilaterals are
    ObjectId material;  ///< a Material; none: the default material
    /// How many pixels of a screen the picture may be off the limit surface: where `level` is not enough for that,
    /// triangles of a higher level are drawn (client/render). 0: those of `level`, wherever the eye is.
    double screenError = 0.5;
};
template <>
inline constexpr auto kSaid<SubdivisionSurface> = []<typename T>(Describing<T>) {
    return describe("SubdivisionSurface", field<&T::points>(1, "points").floats(3).affects(Effect::kShape),
                    field<&T::faceSizes>(2, "faceSizes").integers(1, 4).affects(Effect::kShape),
                    field<&T::faceVertices>(3, "faceVertices").integers(1, 4).affects(Effect::kShape),
                    field<&T::creases>(4, "creases").integers(2, 4).affects(Effect::kShape),
                    field<&T::creaseSharpness>(5, "creaseSharpness").floats(1).affects(Effect::kShape),
                    field<&T::corners>(6, "corners").integers(1, 4).affects(Effect::kShape),
                    field<&T::cornerSharpness>(7, "cornerSharpness").floats(1).affects(Effect::kShape),
                    field<&T::holes>(8, "holes").integers(1, 4).affects(Effect::kShape),
                    field<&T::scheme>(9, "scheme")
                        .oneOf({{SubdivisionSurface::kCatmullClark, "catmull-clark"},
                                {SubdivisionSurface::kLoop, "loop"},
                                {SubdivisionSurface::kBilinear, "bilinear"}})
                        .affects(Effect::kShape),
                    field<&T::boundary>(10, "boundary")
                        .oneOf({{SubdivisionSurface::kNoBoundary, "none"},
                                {SubdivisionSurface::kEdgeOnly, "edge-only"},
                                {SubdivisionSurface::kEdgeAndCorner, "edge-and-corner"}})
                        .affects(Effect::kShape),
                    field<&T::creaseMethod>(11, "creaseMethod")
                        .oneOf({{SubdivisionSurface::kUniform, "uniform"}, {SubdivisionSurface::kChaikin, "chaikin"}})
                        .affects(Effect::kShape),
                    field<&T::triangles>(12, "triangles")
                        .oneOf({{SubdivisionSurface::kPolygon, "polygon"}, {SubdivisionSurface::kSmooth, "smooth"}})
                        .affects(Effect::kShape),
                    field<&T::level>(13, "level").between(0, SubdivisionSurface::kFinestLevel).affects(Effect::kShape),
                    field<&T::material>(14, "material").to(typeOf<Material>()).affects(Effect::kLook),
                    field<&T::screenError>(15, "screenError").between(0, 1e6).affects(Effect::kLook));
};

}  // namespace tessera
