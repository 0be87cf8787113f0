#include "client/replica/TilePainter.h"

namespace tessera {

Expected<PaintedTile> TilePainter::paint(const RenderScene& scene, Renderer& renderer, const ScreenCamera& camera,
                                         const ProcessorQueue& queue, const DrawPicture& draw) {
    const SceneVersion version = scene.version();
    const std::uint64_t programs = renderer.programChanges();
    const bool seenAlike =
        last_.picture && version.contents == version_.contents && programs == programs_ && drawAlike(camera, camera_);
    PaintedTile painted = last_;
    painted.again = true;
    painted.cull = painted.draw = painted.cullQueued = painted.drawQueued = {};
    if (seenAlike && version.scene == version_.scene) return painted;

    const TimePoint begin = queue.now();
    const Duration queuedBefore = queue.waited();
    auto culled = action_.run(scene, camera, rect_, asks_ ? &renderer.visibility() : nullptr, &painted.counts);
    if (!culled) return tl::unexpected(culled.error());
    DrawList list = std::move(*culled);
    const TimePoint afterCull = queue.now();
    const Duration queuedToCull = queue.waited();
    painted.cull = afterCull - begin;
    painted.cullQueued = queuedToCull - queuedBefore;
    if (!seenAlike || !drawAlike(list, list_)) {
        auto picture = draw(list);
        if (!picture) return tl::unexpected(picture.error());
        painted.picture = std::make_shared<const Picture>(std::move(*picture));
        painted.again = false;
        painted.draw = queue.now() - afterCull;
        painted.drawQueued = queue.waited() - queuedToCull;
        painted.skipped = renderer.lastCounts().skipped;
        painted.trouble = renderer.lastCounts().trouble;
        painted.lightsLeftOut = renderer.lastCounts().lightsLeftOut;
        painted.scopesLeftOut = renderer.lastCounts().scopesLeftOut;
    }
    painted.narrowed = list.narrowed;
    last_ = painted;
    camera_ = camera;
    version_ = version;
    programs_ = programs;
    list_ = std::move(list);
    return painted;
}

}  // namespace tessera
