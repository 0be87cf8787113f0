// What is told of a thing that is left out of every picture.
#include <cmath>

#include <fmt/format.h>

#include "client/render/scene/RenderScene.h"
#include "common/cores/Glyphs.h"
#include "common/drawable/Drawable.h"
#include "common/geometry/Utmost.h"
#include "common/scene/Action.h"

namespace tessera {

std::string whyNotDrawn(const Aspect& aspect, ObjectId node) {
    const std::string path = pathOf(aspect, node);
    const Node* found = aspect.get<Node>(node);
    const Drawable drawable = found ? drawableOf(aspect, *found) : Drawable();
    if (!drawable) return path + " is not drawn";
    if (const Expected<void> sound = drawable.check(); !sound)
        return fmt::format("{} is not drawn: {}", path, sound.error().message);
    const MeshArrays arrays = drawable.arrays();
    if (const Expected<void> whole = checkMesh(arrays); !whole)
        return fmt::format("{} is not drawn: {}", path, whole.error().message);
    // The farthest; of several the first. What is not a number is farther than all.
    const Affine3d world_T_node = worldTransform(aspect, node);
    const std::span<const float> positions = arrays.positions.as<float>();
    std::size_t vertex = 0;
    double farthest = -1;
    for (std::size_t i = 0; i + 2 < positions.size(); i += 3) {
        const double reach =
            (world_T_node * Vec3d(positions[i], positions[i + 1], positions[i + 2])).cwiseAbs().maxCoeff();
        if (reach > farthest || !std::isfinite(reach)) {
            farthest = reach;
            vertex = i / 3;
        }
        if (!std::isfinite(reach)) break;
    }
    // As many vertices each; a person knows the glyph.
    const auto* glyphs = aspect.get<Glyphs>(found->core);
    const std::size_t each = glyphs ? positions.size_bytes() / glyphs->positions.sizeBytes() : 1;
    const std::string what = fmt::format("{} {}", glyphs ? "glyph" : "vertex", vertex / each);
    if (!std::isfinite(farthest))
        return fmt::format("{} is not drawn: {} comes to lie nowhere, as its place in the world is beyond all numbers",
                           path, what);
    return fmt::format("{} is not drawn: {} comes to lie {:g} world units from the origin; things are drawn up to {:g}",
                       path, what, farthest, kUtmostCoordinate);
}

}  // namespace tessera
