/// The kinds of things that are drawn, and what each is to whoever culls, sorts and lights it: a row each. How GL draws
/// a kind is its row in client/draw/store/DrawForms.h.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/drawable/GlyphArrays.h"
#include "common/drawable/ParticleArrays.h"
#include "common/drawable/VolumeShapes.h"
#include "common/geometry/Mesh.h"

namespace tessera {

enum class DrawKind : std::uint8_t {
    kTriangles,
    kPoints,  ///< balls
    kLines,   ///< as wide on the screen wherever they are
    // Particles (ParticleArrays.h), two triangles each:
    kDiscs,    ///< round on the screen
    kStreaks,  ///< lines, each as wide as it says
    kSprites,  ///< squares that face the user's head
    // Scalar fields (VolumeShapes.h):
    kMarched,  ///< a box that rays go through
    kSlices,   ///< planes through it
    // Copies of a mesh (MeshCopies.h):
    kGlyphs,
};

struct DrawKindRow {
    DrawKind kind;
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

inline constexpr std::array<DrawKindRow, 9> kDrawKinds = {{
    {.kind = DrawKind::kTriangles,
     .ownTriangles = true,
     .hides = true,
     .castsShadows = true,
     .surface = true,
     .standsOut = false,
     .volume = false,
     .particles = false},
    {.kind = DrawKind::kPoints,
     .ownTriangles = false,
     .hides = true,
     .castsShadows = true,
     .surface = true,
     .standsOut = false,
     .volume = false,
     .particles = false},
    {.kind = DrawKind::kLines,
     .ownTriangles = false,
     .hides = false,
     .castsShadows = false,
     .surface = false,
     .standsOut = true,
     .volume = false,
     .particles = false},
    {.kind = DrawKind::kDiscs,
     .ownTriangles = false,
     .hides = false,
     .castsShadows = false,
     .surface = false,
     .standsOut = false,
     .volume = false,
     .particles = true},
    {.kind = DrawKind::kStreaks,
     .ownTriangles = false,
     .hides = false,
     .castsShadows = false,
     .surface = false,
     .standsOut = true,
     .volume = false,
     .particles = true},
    {.kind = DrawKind::kSprites,
     .ownTriangles = false,
     .hides = false,
     .castsShadows = false,
     .surface = false,
     .standsOut = false,
     .volume = false,
     .particles = true},
    {.kind = DrawKind::kMarched,
     .ownTriangles = false,
     .hides = false,
     .castsShadows = false,
     .surface = false,
     .standsOut = false,
     .volume = true,
     .particles = false,
     .fineness = kVolumeOnScreens},
    {.kind = DrawKind::kSlices,
     .ownTriangles = false,
     .hides = false,
     .castsShadows = false,
     .surface = true,
     .standsOut = false,
     .volume = true,
     .particles = false,
     .fineness = kVolumeOnScreens},
    // A tile that looks for occluders would look at all of them.
    {.kind = DrawKind::kGlyphs,
     .ownTriangles = false,
     .hides = false,
     .castsShadows = true,
     .surface = true,
     .standsOut = false,
     .volume = false,
     .particles = false,
     .fineness = kGlyphsOnScreens},
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
        case Primitive::kPoints:
            return DrawKind::kPoints;
        case Primitive::kLines:
            return DrawKind::kLines;
        case Primitive::kTriangles:
            break;
    }
    return DrawKind::kTriangles;
}
/// Of any drawable's arrays.
[[nodiscard]] inline DrawKind kindOf(const MeshArrays& arrays) {
    if (!arrays.copies.empty()) return DrawKind::kGlyphs;
    if (const VolumeShape shape = volumeShapeOf(arrays); shape != VolumeShape::kNone)
        return shape == VolumeShape::kBox ? DrawKind::kMarched : DrawKind::kSlices;
    if (!areParticles(arrays)) return kindOf(arrays.primitive);
    if (!arrays.lines.empty()) return DrawKind::kStreaks;
    return arrays.texcoords1.empty() ? DrawKind::kDiscs : DrawKind::kSprites;
}

}  // namespace tessera
