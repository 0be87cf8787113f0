/// What items are drawn with, resolved once, where the scene meets a material: whoever makes something of it keeps that
/// by its serial and makes it anew when its version is another.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "common/cores/Image.h"
#include "common/cores/Material.h"
#include "common/scene/Aspect.h"

namespace tessera {

/// One material by itself: without those that are drawn over it or in its place. What it says stands in the aspect.
struct LookSource {
    ObjectId material;          ///< none: the one of what has none
    std::uint64_t serial = 0;   ///< nextSerial's
    std::uint64_t version = 0;  ///< grows when anything that it is made of changes: fields, images, layers, program,
                                ///< uniforms
    bool doubleSided = false;
    /// What its normals come from, without its pixels; null: nothing.
    std::shared_ptr<const Image> normalImage;
    bool shapes = false;  ///< it decides where its surface is: alpha cuts holes, or a program may
};

/// A material with the passes that are drawn over it, and the coarser ones that stand for it. It stays the same object
/// while its material is in use, and says what the scene said when it was updated last.
struct DrawMaterial {
    struct Layer {
        std::shared_ptr<const LookSource> look;
        bool blended = false;  ///< over what is there; else in its place
        std::int64_t fill = Material::kFilled;
        float lineWidth = 0;  ///< pixels, of edges and corners
    };
    struct Level {
        Layer own;
        std::vector<Layer> passes;  ///< in their order; none where the material's program is bad
        double coarserBelow = 0;    ///< pixels: the next level stands for it where it is smaller
    };
    std::vector<Level> levels;  ///< itself, then the coarser ones; never empty
};

/// Of the server's verdict: it is drawn as what is wrong.
[[nodiscard]] bool hasBadProgram(const Aspect& aspect, const Material& material);
/// The passes of a material that are drawn, in their order: what is no Material any more is left away.
[[nodiscard]] std::vector<ObjectId> passesOf(const Aspect& aspect, const Material& material);
/// What may stand for a material, the next coarser one first: to the end of the chain, to where it comes back to
/// itself, or kMostCoarser of them.
[[nodiscard]] std::vector<ObjectId> coarserOf(const Aspect& aspect, const Material& material);
inline constexpr std::size_t kMostCoarser = 8;
/// Whether a pass is blended over what is there, not put in its place.
[[nodiscard]] bool isBlended(const Material& pass);

/// What a source says of itself besides its version.
void describe(const Aspect& aspect, LookSource& source);
/// `source` gives that of any material.
using SourceOf = std::function<std::shared_ptr<const LookSource>(ObjectId)>;
[[nodiscard]] std::vector<DrawMaterial::Level> levelsOf(const Aspect& aspect, ObjectId material,
                                                        const SourceOf& source);
/// For whoever makes a list without a RenderScene: of this aspect as it is now.
[[nodiscard]] std::shared_ptr<const DrawMaterial> drawMaterialOf(const Aspect& aspect, ObjectId material);

}  // namespace tessera
