// What is done to each pixel of a cell after the first pass: light, then what is transparent.
#include "client/draw/RendererImpl.h"

namespace tessera {

Expected<void> Renderer::Impl::drawCell(const DrawList& list, const ScreenCamera& screen, const CellPart& cell) {
    if (auto begun = beginCell(list, screen, cell, tile); !begun) return begun;
    if (auto drawn = issue(0, calls.opaqueCount(), ProgramKind::Use::kSurface); !drawn) return drawn;
    if (auto lit = lightSurfaces(); !lit) return lit;
    return blends() ? blendTransparent() : Expected<void>();
}

Expected<void> Renderer::Impl::drawOverScreen(const ProgramKind& kind) {
    if (auto used = useProgram(kind); !used) return used;
    gl.BindVertexArray(emptyArray);
    gl.Disable(GL_CULL_FACE);
    if (auto ready = prepareForOtherLights(kind); !ready) return ready;
    gl.DrawArrays(GL_TRIANGLES, 0, 3);
    return {};
}

Expected<void> Renderer::Impl::prepareForShadows(const ProgramKind& kind) {
    const ProgramKind cast = shadowOf(kind);
    if (kind.lines || !prepared.insert(cast).second) return {};
    gl.BindFramebuffer(GL_FRAMEBUFFER, shadows.framebuffer());
    gl.Scissor(0, 0, 0, 0);
    if (auto used = useProgram(cast); !used) return used;
    gl.DrawArrays(GL_TRIANGLES, 0, 3);
    gl.Scissor(scissor.x, scissor.y, scissor.width, scissor.height);
    gl.BindFramebuffer(GL_FRAMEBUFFER, surfacesNow);
    return useProgram(kind);
}

/// A software rasteriser compiles when it first draws with a state: here into an empty rectangle.
Expected<void> Renderer::Impl::prepareForOtherLights(const ProgramKind& kind) {
    if (kind.use == ProgramKind::Use::kSurface) return prepareForShadows(kind);
    if (!isLit(kind.use)) return {};
    if (!prepared.insert(otherwiseLit(kind, LightLists::kNone, false)).second) return {};
    gl.Scissor(0, 0, 0, 0);
    for (const LightLists lists : kAllLightLists) {
        for (const bool environment : {false, true}) {
            const ProgramKind other = otherwiseLit(kind, lists, environment);
            if (other == kind) continue;
            if (auto used = useProgram(other); !used) return used;
            gl.DrawArrays(GL_TRIANGLES, 0, 3);
        }
    }
    gl.Scissor(scissor.x, scissor.y, scissor.width, scissor.height);
    return useProgram(kind);
}

/// Each pixel is lit once, however many surfaces were drawn into it, and once more where its samples show different
/// ones. Where something will be blended over the picture each sample gets the colour that it shows.
Expected<void> Renderer::Impl::lightSurfaces() {
    using Use = ProgramKind::Use;
    const auto framebuffer = tile.picture();
    if (!framebuffer) return tl::unexpected(framebuffer.error());
    gl.BindFramebuffer(GL_FRAMEBUFFER, *framebuffer);
    bindSurfaces();
    gl.DepthFunc(GL_ALWAYS);
    if (auto sorted = drawOverScreen(kindOf(Use::kClassify)); !sorted) return sorted;
    gl.DepthMask(GL_FALSE);
    gl.DepthFunc(GL_EQUAL);
    if (auto lit = drawOverScreen(kindOf(Use::kLightOne)); !lit || options.samples == 1) return lit;
    gl.DepthFunc(GL_LESS);
    if (auto lit = drawOverScreen(kindOf(Use::kLight)); !lit) return lit;
    const bool perSample = blends();
    if (perSample)
        if (auto copied = copyToSamples(); !copied) return copied;
    const ProgramKind kind = kindOf(Use::kLightRest);
    bindSurfaces();
    gl.DepthFunc(GL_LESS);
    if (perSample) {
        const auto rest = tile.rest();
        if (!rest) return tl::unexpected(rest.error());
        const std::array<GLfloat, 4> nothing{};
        gl.ClearNamedFramebufferfv(*rest, GL_COLOR, 0, nothing.data());
        gl.BindFramebuffer(GL_FRAMEBUFFER, *rest);
        if (auto lit = drawOverScreen(kind); !lit) return lit;
    }
    gl.BindFramebuffer(GL_FRAMEBUFFER, *framebuffer);
    gl.Enable(GL_BLEND);
    gl.BlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ZERO, GL_ONE);
    return drawOverScreen(kind);
}

void Renderer::Impl::bindSurfaces() {
    gl.BindTextureUnit(0, tile.surfaceTexture());
    gl.BindTextureUnit(1, tile.depthTexture());
    gl.BindTextureUnit(2, materialTexture);
    if (scene.detail) gl.BindTextureUnit(kDetailUnit, tile.detailTexture());
    lights.bind(kLightUnit, kListUnit);
    surroundings.bind(kSurroundingsUnit);
    shadows.bind(kShadowUnit);
}

bool Renderer::Impl::blends() const {
    return calls.opaqueCount() < inCell.size() && inCell.back().end > inCell[calls.opaqueCount()].first;
}

Expected<void> Renderer::Impl::copyToSamples() {
    const auto framebuffer = tile.blended();
    if (!framebuffer) return tl::unexpected(framebuffer.error());
    gl.BindFramebuffer(GL_FRAMEBUFFER, *framebuffer);
    gl.BindTextureUnit(0, tile.pictureTexture());
    gl.DepthFunc(GL_ALWAYS);
    return drawOverScreen(kindOf(ProgramKind::Use::kCopy));
}

/// Alpha adds up from 0, so that it tells where anything was blended: the rest of the picture stays as it is, to the bit.
Expected<void> Renderer::Impl::blendTransparent() {
    const auto framebuffer = tile.blended();
    if (!framebuffer) return tl::unexpected(framebuffer.error());
    gl.BindFramebuffer(GL_FRAMEBUFFER, *framebuffer);
    gl.DepthMask(GL_FALSE);
    if (options.samples > 1) {
        gl.Disable(GL_BLEND);
        gl.DepthFunc(GL_ALWAYS);
        gl.BindTextureUnit(0, tile.surfaceTexture());
        gl.BindTextureUnit(1, tile.restTexture());
        if (auto spread = drawOverScreen(kindOf(ProgramKind::Use::kSpread)); !spread)
            return spread;
    }
    gl.DepthFunc(GL_GREATER);
    gl.Enable(GL_BLEND);
    gl.BlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE);
    if (auto drawn = issue(calls.opaqueCount(), calls.calls().size(), ProgramKind::Use::kBlend);
        !drawn || options.samples == 1)
        return drawn;
    gl.BindFramebuffer(GL_FRAMEBUFFER, tile.picture().value());
    gl.BindTextureUnit(0, tile.blendedTexture());
    gl.Disable(GL_BLEND);
    gl.DepthFunc(GL_ALWAYS);
    return drawOverScreen(kindOf(ProgramKind::Use::kResolve));
}

}  // namespace tessera
