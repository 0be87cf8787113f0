/// NURBS surfaces, trimmed or not: points, derivatives, normals; knots and degrees added; the Bézier patches that they
/// are made of.
///
/// Piegl and Tiller, The NURBS Book (evaluation, Boehm's knot insertion); patches by blossoms (Ramshaw 1989).
/// Immutable: any thread.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "common/freeform/BezierPatch.h"
#include "common/freeform/nurbs/KnotVector.h"
#include "common/freeform/nurbs/TrimRegion.h"

namespace tessera {

/// What a surface is made of, not yet checked.
struct NurbsDefinition {
    KnotVector u, v;
    /// (w·x, w·y, w·z, w), u fastest: u.count() · v.count() of them. With equal weights a polynomial surface.
    std::vector<Vec4d> points;
    std::optional<ParameterRange> rangeU,
        rangeV;  ///< the part that there is; of what the knots define, all unless told otherwise
    std::vector<TrimLoop> loops;
};

/// A point, and whether trimming leaves it.
struct NurbsPoint {
    SurfacePoint at;
    TrimSide side = TrimSide::kTrimmedAway;
};

/// A part of a surface as a Bézier patch; (u, v) in [0, 1]² of the patch are spread evenly over the rectangle.
struct ParameterPatch {
    BezierPatch patch;
    ParameterRectangle over;
};

class NurbsSurface {
public:
    /// Refuses in words: degrees not in 1 to kMaxNurbsDegree, counts that do not agree, knots that descend or are equal
    /// too often, numbers that are not finite or beyond kMaxNurbsNumber, weights not above 0 (1 / kMaxNurbsWeight to
    /// kMaxNurbsWeight), a range that the knots do not define, loops that TrimRegion refuses.
    [[nodiscard]] static Expected<NurbsSurface> make(NurbsDefinition definition);

    [[nodiscard]] const NurbsDefinition& definition() const { return definition_; }
    [[nodiscard]] const ParameterRectangle& domain() const { return region_.rectangle(); }
    [[nodiscard]] const TrimRegion& region() const { return region_; }

private:
    explicit NurbsSurface(NurbsDefinition definition, TrimRegion region)
        : definition_(std::move(definition)), region_(std::move(region)) {}

    NurbsDefinition definition_;
    TrimRegion region_;
};

/// At the surface's own parameters, those of its knots; derivatives are by them. Where the surface jumps, at a knot of
/// multiplicity degree + 1, what lies above the knot. Outside its domain, or at what is no number: the nearest point of
/// the domain, trimmed away.
[[nodiscard]] NurbsPoint evaluate(const NurbsSurface& surface, double u, double v);

/// One patch per pair of knot spans that are not empty, u fastest; trimmed or not. Patches share the bits of the
/// control points on a common edge wherever the surface is continuous.
[[nodiscard]] std::vector<ParameterPatch> bezierPatches(const NurbsSurface& surface);

}  // namespace tessera
