/// A NURBS surface, trimmed or not: what travels, is undone and animated are its control points.
#pragma once

#include "common/cores/ShippedTypes.h"
#include "common/field/Field.h"

namespace tessera {

/// A scene's NurbsSurface. Knots, weights and trims mean what `common/freeform/nurbs/NurbsSurface.h` says, which
/// refuses what makes no surface. Picked and collided with as triangles within the tolerance, closed where the surface
/// is, the same everywhere
/// (`common/drawable`). A screen draws these, or finer ones where `screenError` asks for it. Trims that cross, or leave
/// what the knots define, are refused by name.
struct NurbsSurfaceCore {
    static constexpr ObjectType kType{19};
    static constexpr std::int64_t kHighestDegree = 24;
    std::int64_t degreeU = 3, degreeV = 3;
    Blob knotsU;   ///< double, degreeU + 1 more than there are control points along u
    Blob knotsV;   ///< likewise
    Blob points;   ///< double[3] per control point, u fastest
    Blob weights;  ///< double per control point, above 0; empty: all are 1
    Blob range;    ///< double[4]: the u and v where it begins and ends (u, u, v, v); empty: all that the knots define
    Blob loops;    ///< uint32[2] per loop of trims: 0 around what is kept, 1 around a hole; how many curves
    Blob curves;   ///< uint32[2] per curve of these, loop after loop: degree, control points
    Blob curveKnots;   ///< double, curve after curve
    Blob curvePoints;  ///< double[3] per control point, curve after curve: u, v, weight
    Blob curveRanges;  ///< double[2] per curve: from which of its parameters to which; empty: all of each
    /// No triangle is farther from the surface than this, in its own coordinates. 0: a thousandth of the diagonal of
    /// the control points.
    double tolerance = 0;
    ObjectId material;  ///< a Material; none: the default material
    /// How many pixels of a screen the picture may be off the surface: where `tolerance` is not enough for that,
    /// triangles of a smaller one are drawn (client/render). 0: those of `tolerance`, wherever the eye is.
    double screenError = 0.5;
};
template <>
inline constexpr auto kSaid<NurbsSurfaceCore> = []<typename T>(Describing<T>) {
    return describe(
        "NurbsSurface",
        field<&T::degreeU>(1, "degreeU").between(1, NurbsSurfaceCore::kHighestDegree).affects(Effect::kShape),
        field<&T::degreeV>(2, "degreeV").between(1, NurbsSurfaceCore::kHighestDegree).affects(Effect::kShape),
        field<&T::knotsU>(3, "knotsU").doublesEach(1).affects(Effect::kShape),
        field<&T::knotsV>(4, "knotsV").doublesEach(1).affects(Effect::kShape),
        field<&T::points>(5, "points").doublesEach(3).affects(Effect::kShape),
        field<&T::weights>(6, "weights").doublesEach(1).affects(Effect::kShape),
        field<&T::range>(7, "range").doublesEach(1).affects(Effect::kShape),
        field<&T::loops>(8, "loops").integers(2, 4).affects(Effect::kShape),
        field<&T::curves>(9, "curves").integers(2, 4).affects(Effect::kShape),
        field<&T::curveKnots>(10, "curveKnots").doublesEach(1).affects(Effect::kShape),
        field<&T::curvePoints>(11, "curvePoints").doublesEach(3).affects(Effect::kShape),
        field<&T::curveRanges>(12, "curveRanges").doublesEach(2).affects(Effect::kShape),
        field<&T::tolerance>(13, "tolerance").between(0, 1e12).affects(Effect::kShape),
        field<&T::material>(14, "material").to(typeOf<Material>()).affects(Effect::kLook),
        field<&T::screenError>(15, "screenError").between(0, 1e6).affects(Effect::kLook));
};

}  // namespace tessera
