/// The kinds of things that are drawn, and what each is to whoever culls, sorts and lights it: a row each. How GL draws
/// a kind is its row in client/draw/store/DrawForms.h.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/drawable/GlyphArrays.h"
#include "common/drawable/VolumeShapes.h"
#include "common/geometry/Mesh.h"

namespace tessera {

struct DrawKindRow {
    MeshKind kind;
    /// Its arrays are the triangles that are drawn: cut into clusters, made occluders of.
    bool ownTriangles;
    bool hides;  ///< nothing is seen through what it covers, as far as its material says
    bool castsShadows;
    bool surface;    ///< has sides and is lit; of glass its own triangles are sorted one by one, glyphs of one core are
                     ///< not. Else its base colour is what is seen, from everywhere
    bool standsOut;  ///< on the screen, beyond the box around it: see lineReachPx
    bool volume;     ///< transparent; the core says what is seen, no material
    bool particles;  ///< transparent whatever its material; its radius says whether it is sorted by itself
    unsigned fineness = 0;  ///< that its arrays are of: see finenessOnScreens
};

inline constexpr std::array<DrawKindRow, kMeshKinds> kDrawKinds = {{
    {.kind = MeshKind::kTriangles,
     .ownTriangles = true,
     .hides = true,
     .castsShadows = true,
     .surface = true,
     .standsOut = false,
     .volume = false,
     .particles = false},
    {.kind = MeshKind::kPoints,
     .ownTriangles = false,
     .hides = true,
     .castsShadows = true,
     .surface = true,
     .standsOut = false,
     .volume = false,
     .particles = false},
    {.kind = MeshKind::kLines,
     .ownTriangles = false,
     .hides = false,
     .castsShadows = false,
     .surface = false,
     .standsOut = true,
     .volume = false,
     .particles = false},
    {.kind = MeshKind::kDiscs,
     .ownTriangles = false,
     .hides = false,
     .castsShadows = false,
     .surface = false,
     .standsOut = false,
     .volume = false,
     .particles = true},
    {.kind = MeshKind::kStreaks,
     .ownTriangles = false,
     .hides = false,
     .castsShadows = false,
     .surface = false,
     .standsOut = true,
     .volume = false,
     .particles = true},
    {.kind = MeshKind::kSprites,
     .ownTriangles = false,
     .hides = false,
     .castsShadows = false,
     .surface = false,
     .standsOut = false,
     .volume = false,
     .particles = true},
    {.kind = MeshKind::kMarched,
     .ownTriangles = false,
     .hides = false,
     .castsShadows = false,
     .surface = false,
     .standsOut = false,
     .volume = true,
     .particles = false,
     .fineness = kVolumeOnScreens},
    {.kind = MeshKind::kSlices,
     .ownTriangles = false,
     .hides = false,
     .castsShadows = false,
     .surface = true,
     .standsOut = false,
     .volume = true,
     .particles = false,
     .fineness = kVolumeOnScreens},
    // A tile that looks for occluders would look at all of them.
    {.kind = MeshKind::kGlyphs,
     .ownTriangles = false,
     .hides = false,
     .castsShadows = true,
     .surface = true,
     .standsOut = false,
     .volume = false,
     .particles = false,
     .fineness = kGlyphsOnScreens},
}};

[[nodiscard]] constexpr const DrawKindRow& rowOf(MeshKind kind) {
    return kDrawKinds[static_cast<std::size_t>(kind)];
}
static_assert([] {
    for (const DrawKindRow& row : kDrawKinds)
        if (&rowOf(row.kind) != &row) return false;
    return true;
}());

}  // namespace tessera
