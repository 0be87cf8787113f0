/// A small mesh at very many places as Glyphs: 28 bytes a place, where a node is about a kilobyte.
#pragma once

#include <optional>
#include <string>

#include "server/import/reader/PlainScene.h"

namespace tessera {

struct GlyphPlace {
    Vec3d position = Vec3d::Zero();
    Quatd orientation = Quatd::Identity();
    Vec3d scale = Vec3d::Ones();
};

/// Whether a glyph, whose Y axis is turned the shortest way to its vector, stands as this place does.
[[nodiscard]] bool isGlyphPlace(const GlyphPlace& place);

/// Glyphs of this shape, without places. Nothing: its mesh is none of triangles, has colours or images, or is too
/// large. `place`: of the mesh in each glyph; a mirror would turn its faces.
[[nodiscard]] std::optional<proto::scene::Glyphs> glyphsOf(const PlainScene& scene, const std::string& mesh,
                                                           const std::string& material, const Affine3d& place);
/// How many places one core of these may have.
[[nodiscard]] std::size_t mostPlacesOf(const proto::scene::Glyphs& glyphs);
void addPlace(proto::scene::Glyphs& glyphs, const GlyphPlace& place);

}  // namespace tessera
