/// One thing at very many places, as glyphs: 48 bytes a place and mesh at most, where a node with a thing of its own
/// takes a kilobyte.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/Error.h"
#include "common/math/Types.h"
#include "proto/scene.pb.h"
#include "server/import/reader/PlainScene.h"

namespace tessera {

/// As many places are worth a node each: anybody may pick, move and hit one.
inline constexpr std::size_t kMostPlacedNodes = 10'000;
/// Beyond that, or where things of several parts would be three times as many nodes.
[[nodiscard]] constexpr bool areVeryMany(std::size_t places, std::size_t parts) {
    return places > kMostPlacedNodes || places * (parts + 1) > 3 * kMostPlacedNodes;
}

/// Where one stands, in the coordinates of the node above all of them.
struct CopyPlace {
    Vec3d position = Vec3d::Zero();
    Quatd turn = Quatd::Identity();  ///< of any length but 0
    Vec3d scale = Vec3d::Ones();
    std::uint32_t color = 0xffffffff;  ///< 0xRRGGBBAA, sRGB: multiplies the thing's own
};

/// A mesh as the shape of glyphs.
struct GlyphPart {
    proto::scene::Glyphs shape;        ///< with no positions yet
    std::uint32_t color = 0xffffffff;  ///< 0xRRGGBBAA, sRGB: of all its vertices
};

using GlyphNodes = std::function<proto::scene::Node*(std::size_t first, std::size_t part)>;

/// One mesh at `place`. Refused (kUnsupported) in words that follow "its mesh": it is too large, no triangles, flat
/// there, of vertices in several colours, or with images at a second set of texture coordinates. Normal maps go without
/// the mesh's own tangents.
[[nodiscard]] Expected<GlyphPart> glyphOf(const PlainScene& scene, const std::string& mesh, const std::string& material,
                                          const Affine3d& place);

/// What nodes of very many are called: by the first that it has.
[[nodiscard]] std::string instancesName(std::size_t first, std::size_t part);

/// The parts at each of `which`, in nodes that `make` gives for a first one and a part. What comes back is left for
/// nodes: of scales that differ along all axes, or are 0 along one.
[[nodiscard]] std::vector<std::size_t> addGlyphs(std::span<const std::size_t> which,
                                                 const std::function<CopyPlace(std::size_t)>& placeOf,
                                                 const std::vector<GlyphPart>& parts, const GlyphNodes& make);

/// Says so where the parts are transparent: nodes are sorted, glyphs of one node are not.
void noteUnsorted(PlainScene& scene, std::string_view where, const std::vector<GlyphPart>& parts);

/// Why `addGlyphs` left some.
inline constexpr std::string_view kOddScales = "their scales differ along all three axes, or are 0";
/// What a person reads of very many places that are nodes all the same.
[[nodiscard]] std::string noteOfPlacedNodes(std::string_view where, std::size_t count, std::string_view why);

}  // namespace tessera
