/// A NURBS surface as triangles within a stated distance of it, without gaps: what is drawn and collided with.
///
/// The parameters are halved into cells until each is proven flat (bilinearDeviation): any triangle whose corners are
/// points of the surface over one cell is as near to it as the cell says, whatever its shape. So cells are triangulated
/// freely, with the vertices that their neighbours and trims have on their sides. The edges of the domain are cut by
/// their own curves alone: surfaces that share the control points and knots of an edge, whichever way they run, have
/// the same vertices there, bit for bit. Closed surfaces and poles close likewise.
///
/// The same bytes for the same surface: no threads, sums in a fixed order. Pure; any thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/base/Error.h"
#include "common/freeform/nurbs/NurbsSurface.h"

namespace tessera {

struct NurbsTriangles {
    std::vector<Vec3d> positions;
    std::vector<Vec3d>
        normals;  ///< of length 1; each side of a crease has vertices of its own, at the bits of the same position
    std::vector<Vec2d> parameters;  ///< (u, v)
    std::vector<std::array<std::uint32_t, 3>>
        triangles;  ///< counterclockwise seen from where normals point; none has two corners at one place
    /// No triangle is farther from the trimmed surface than this, nor any point of that from the triangles. At most
    /// what was asked for. (What of a surface is no more than a curve has none.)
    double error = 0;
};

struct TessellationLimits {
    std::size_t maxTriangles = 2'000'000;
    /// Of two control points each: what patches cost to make and to halve, some nanoseconds a sum with all that goes
    /// with it. Those that all knot spans need are counted before one is made.
    std::size_t maxSums = ~std::size_t{0};
};

/// `tolerance` in the surface's units, above 0. Refused: what TrimOutline refuses of trims; kLimit where it takes more
/// triangles or sums, or a surface bends more within 2^-40 of a knot span.
[[nodiscard]] Expected<NurbsTriangles> tessellate(const NurbsSurface& surface, double tolerance,
                                                  const TessellationLimits& limits = {});

}  // namespace tessera
