#include "client/replica/TilePainter.h"

namespace tessera {

Expected<PaintedTile> TilePainter::paint(const Aspect& aspect, const RenderScene& scene, Renderer& renderer,
                                         const ScreenCamera& camera) {
    const SceneVersion version = scene.version();
    const bool seenAlike = last_.picture && version.contents == version_.contents && drawAlike(camera, camera_);
    PaintedTile painted = last_;
    painted.again = true;
    painted.cull = painted.draw = {};
    if (seenAlike && version.scene == version_.scene) return painted;

    const TimePoint begin = clockNow();
    auto culled = action_.run(scene, camera, rect_, asks_ ? &renderer.visibility(aspect) : nullptr, &painted.counts);
    if (!culled) return tl::unexpected(culled.error());
    DrawList list = std::move(*culled);
    const TimePoint afterCull = clockNow();
    painted.cull = afterCull - begin;
    if (!seenAlike || !drawAlike(list, list_)) {
        auto picture = renderer.draw(aspect, list, camera, rect_);
        if (!picture) return tl::unexpected(picture.error());
        painted.picture = std::make_shared<const Picture>(std::move(*picture));
        painted.again = false;
        painted.draw = clockNow() - afterCull;
        painted.skipped = renderer.lastCounts().skipped;
        painted.trouble = renderer.lastCounts().trouble;
        painted.lightsLeftOut = renderer.lastCounts().lightsLeftOut;
    }
    last_ = painted;
    camera_ = camera;
    version_ = version;
    list_ = std::move(list);
    return painted;
}

}  // namespace tessera
