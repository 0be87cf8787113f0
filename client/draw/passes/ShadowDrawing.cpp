// What lights see, into their maps.
#include "client/draw/passes/RendererImpl.h"

namespace tessera {
namespace {

/// The view's part of a layer, to be asked which clusters lie in it. What is before a sun's depths is not beside it.
ClusterSight sightOf(const ShadowView& view, const PixelRect& place, const PixelRect& part) {
    constexpr int kGrownPx = 2;
    ScreenCamera sides = view.camera;
    if (view.clamped) sides.clip_T_eye.row(2).setZero();
    return {sides,
            {.x = part.x - place.x - kGrownPx,
             .y = part.y - place.y - kGrownPx,
             .width = part.width + 2 * kGrownPx,
             .height = part.height + 2 * kGrownPx},
            {.x = 0, .y = 0, .width = place.width, .height = place.height}};
}

PixelRect inLayer(const PixelRect& place, const PixelRect& rect) {
    return {.x = place.x + rect.x, .y = place.y + rect.y, .width = rect.width, .height = rect.height};
}

}  // namespace

/// Once for all tiles and frames that show the scene as it is now. Depths are the nearest ones: what is drawn again
/// over itself, beside the blocks that were emptied, changes nothing.
Expected<void> Renderer::Impl::drawShadows(const Aspect& aspect) {
    for (std::size_t i = 0; i < shadows.views(); ++i) {
        const ShadowMaps::Update update = shadows.update(i);
        if (!update.any) continue;
        const ShadowView& view = shadows.view(i);
        const PixelRect& place = shadows.place(i);
        if (!update.still.empty()) {
            std::vector<DrawItem> seen;
            view.still->all.each([&](const PixelRect& rect) { return update.still.meets(inLayer(place, rect)); },
                                 [&](const ShadowCaster& caster) { seen.push_back(caster.item); });
            shadows.attach(i, update.throughKept);
            if (auto drawn = drawCasters(aspect, i, seen, update.still, true); !drawn) return drawn;
        }
        if (update.keep) shadows.keep(i);
        if (update.throughKept) shadows.copyKept(i, update.copied);
        std::vector<DrawItem> moving;
        for (const ShadowCaster& caster : view.moving)
            if (update.moving.meets(inLayer(place, caster.rect))) moving.push_back(caster.item);
        shadows.attach(i, false);
        if (!moving.empty())
            if (auto drawn = drawCasters(aspect, i, moving, update.moving, false); !drawn) return drawn;
        shadows.setDrawn(i, update);
    }
    return {};
}

/// Into what is attached; `anew`: into nothing.
Expected<void> Renderer::Impl::drawCasters(const Aspect& aspect, std::size_t index, std::span<const DrawItem> seen,
                                           const MapBlocks& blocks, bool anew) {
    const ShadowView& view = shadows.view(index);
    const PixelRect& place = shadows.place(index);
    calls.collectDepth(aspect, seen, view.camera, stores());
    uploadCalls();
    inCell.clear();
    runs.clear();
    scissor = blocks.around();
    const ClusterSight sight = sightOf(view, place, scissor);
    for (const DrawCall& call : calls.calls()) {
        const auto first = static_cast<std::uint32_t>(runs.size());
        const std::uint32_t all = call.mesh.indexCount / 3;
        if (call.item->clusters.empty())
            runs.push_back({0, all});
        else
            sight.appendRuns({.clusters = call.item->clusters, .triangles = all, .backFacesShown = true},
                             call.item->world_T_item, runs);
        inCell.push_back({first, static_cast<std::uint32_t>(runs.size())});
    }
    FrameBlock block = makeFrameBlock({}, view.camera);
    block.pixelRays = pixelRaysOf(view.camera, place.x, place.y);
    upload(block);
    setUp(place, shadows.framebuffer());
    view.clamped ? gl.Enable(GL_DEPTH_CLAMP) : gl.Disable(GL_DEPTH_CLAMP);
    if (anew)
        for (const PixelRect& part : blocks.rectangles()) {
            gl.Scissor(part.x, part.y, part.width, part.height);
            gl.ClearNamedFramebufferfv(shadows.framebuffer(), GL_DEPTH, 0, &kFarthest);
        }
    gl.Scissor(scissor.x, scissor.y, scissor.width, scissor.height);
    const auto drawn = issue(0, calls.opaqueCount(), ProgramKind::Use::kShadow);
    gl.Disable(GL_DEPTH_CLAMP);
    return drawn;
}

}  // namespace tessera
