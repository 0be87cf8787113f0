/// The kinds of things that are drawn, and what each is to whoever culls, sorts and lights it: a row each. How GL draws a kind
/// is its row in client/draw/DrawForms.h.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/geometry/Mesh.h"

namespace tessera {

enum class DrawKind : std::uint8_t {
    kTriangles,
    kPoints,  ///< balls, drawn as octahedra (Points.h)
    kLines,   ///< as wide on the screen wherever they are
};

struct DrawKindRow {
    DrawKind kind;
    /// Its arrays are the triangles that are drawn: cut into clusters, made occluders of.
    bool ownTriangles;
    bool hides;         ///< nothing is seen through what it covers, as far as its material says
    bool castsShadows;
    bool surface;       ///< has sides and is lit, its triangles sorted one by one where it is glass; else its base colour is what is seen, from everywhere
    bool standsOut;     ///< on the screen, beyond the box around it: see lineReachPx
};

inline constexpr std::array<DrawKindRow, 3> kDrawKinds = {{
    {.kind = DrawKind::kTriangles, .ownTriangles = true, .hides = true, .castsShadows = true, .surface = true, .standsOut = false},
    {.kind = DrawKind::kPoints, .ownTriangles = false, .hides = true, .castsShadows = true, .surface = true, .standsOut = false},
    {.kind = DrawKind::kLines, .ownTriangles = false, .hides = false, .castsShadows = false, .surface = false, .standsOut = true},
}};

[[nodiscard]] constexpr const DrawKindRow& rowOf(DrawKind kind) {
    return kDrawKinds[static_cast<std::size_t>(kind)];
}
static_assert([] {
    for (const DrawKindRow& row : kDrawKinds)
        if (&rowOf(row.kind) != &row) return false;
    return true;
}());

/// Of what a Geometry holds.
[[nodiscard]] constexpr DrawKind kindOf(Primitive primitive) {
    switch (primitive) {
        case Primitive::kPoints: return DrawKind::kPoints;
        case Primitive::kLines: return DrawKind::kLines;
        case Primitive::kTriangles: break;
    }
    return DrawKind::kTriangles;
}

}  // namespace tessera
