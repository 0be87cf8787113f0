/// One thing at very many places, as glyphs: 44 bytes a place and mesh at most, where a node with a thing of its own
/// takes a kilobyte.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/math/Types.h"
#include "proto/scene.pb.h"
#include "server/import/reader/PlainScene.h"

namespace tessera {

/// As many places are worth a node each: anybody may pick, move and hit one.
inline constexpr std::size_t kMostPlacedNodes = 10'000;

/// Where one stands, in the coordinates of the node above all of them.
struct CopyPlace {
    Vec3d position = Vec3d::Zero();
    Quatd turn = Quatd::Identity();  ///< of any length but 0
    Vec3d scale = Vec3d::Ones();
};

using GlyphNodes = std::function<proto::scene::Node*(std::size_t first, std::size_t part)>;

/// The glyphs of one mesh at `place`, with no positions yet. Nothing: it is too large, no triangles, with textures or
/// colours of its own, or mirrored there.
[[nodiscard]] std::optional<proto::scene::Glyphs> glyphOf(const PlainScene& scene, const std::string& mesh,
                                                          const std::string& material, const Affine3d& place);

/// What nodes of very many are called: by the first that it has.
[[nodiscard]] std::string instancesName(std::size_t first, std::size_t part);

/// The parts at each of `which`, in nodes that `make` gives for a first one and a part. What comes back is left for
/// nodes: of scales that differ along all axes, or mirror.
[[nodiscard]] std::vector<std::size_t> addGlyphs(std::span<const std::size_t> which,
                                                 const std::function<CopyPlace(std::size_t)>& placeOf,
                                                 const std::vector<proto::scene::Glyphs>& parts,
                                                 const GlyphNodes& make);

}  // namespace tessera
