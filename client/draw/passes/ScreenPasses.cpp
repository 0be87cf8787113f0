// What is done to each pixel of a cell after the first pass: light, then what is transparent.
#include "client/draw/passes/RendererImpl.h"
#include "common/wall/LightHistogram.h"

namespace tessera {
namespace {

ProgramKind::Use useOf(Pass pass) {
    using Use = ProgramKind::Use;
    switch (pass) {
        case Pass::kSurfaces:
            return Use::kSurface;
        case Pass::kClear:
        case Pass::kClearDepth:
            return Use::kClear;
        case Pass::kClassify:
            return Use::kClassify;
        case Pass::kLightOne:
            return Use::kLightOne;
        case Pass::kLight:
            return Use::kLight;
        case Pass::kLightRest:
        case Pass::kRestAlone:
            return Use::kLightRest;
        case Pass::kMeter:
            return Use::kMeter;
        case Pass::kCopy:
            return Use::kCopy;
        case Pass::kSpread:
            return Use::kSpread;
        case Pass::kBlend:
            return Use::kBlend;
        case Pass::kResolve:
            return Use::kResolve;
        case Pass::kShadow:
            return Use::kShadow;
    }
    return Use::kSurface;
}

}  // namespace

Expected<void> Renderer::Impl::drawCell(const DrawList& list, const ScreenCamera& screen, const CellPart& cell) {
    if (auto begun = beginCell(list, screen, cell, tile); !begun) return begun;
    if (auto drawn = issue(0, calls.opaqueCount(), ProgramKind::Use::kSurface); !drawn) return drawn;
    if (auto lit = lightSurfaces(); !lit) return lit;
    if (list.environment.metered)
        if (auto read = meter(cell); !read) return read;
    return blendTransparent();
}

Expected<void> Renderer::Impl::enter(Pass pass) {
    const bool severalSamples = samples > 1;
    Expected<GLuint> framebuffer = GLuint{0};
    switch (pass) {
        case Pass::kSurfaces:
            return {};
        case Pass::kClear:
        case Pass::kClearDepth:
            framebuffer = scene.detail ? tile.detailedSurfaces() : tile.surfaces();
            break;
        case Pass::kClassify:
        case Pass::kLight:
        case Pass::kLightRest:
        case Pass::kResolve:
            framebuffer = tile.picture();
            break;
        case Pass::kLightOne:
            // Of one sample the surfaces' own depth says where something is.
            framebuffer = severalSamples ? tile.picture() : tile.blended();
            break;
        case Pass::kRestAlone:
            framebuffer = tile.rest();
            break;
        case Pass::kMeter:
            framebuffer = tile.meter();
            break;
        case Pass::kCopy:
        case Pass::kSpread:
        case Pass::kBlend:
            framebuffer = tile.blended();
            break;
        case Pass::kShadow:
            framebuffer = shadows.framebuffer();
            break;
    }
    if (!framebuffer) return tl::unexpected(framebuffer.error());
    gl.BindFramebuffer(GL_FRAMEBUFFER, *framebuffer);
    const bool clears = pass == Pass::kClear || pass == Pass::kClearDepth;
    if (clears) {
        // What is drawn into is not read.
        for (const GLuint unit : {GLuint{0}, GLuint{1}, kDetailUnit}) gl.BindTextureUnit(unit, 0);
    } else
        bindSurfaces();
    if (pass == Pass::kCopy) gl.BindTextureUnit(0, tile.pictureTexture());
    if (pass == Pass::kSpread) gl.BindTextureUnit(1, tile.restTexture());
    if (pass == Pass::kResolve) gl.BindTextureUnit(0, tile.blendedTexture());
    const bool writesDepth = clears || pass == Pass::kClassify || pass == Pass::kShadow;
    gl.DepthMask(writesDepth ? GL_TRUE : GL_FALSE);
    const GLboolean writesColor = pass == Pass::kClassify || pass == Pass::kClearDepth ? GL_FALSE : GL_TRUE;
    gl.ColorMask(writesColor, writesColor, writesColor, writesColor);
    const bool sorted = pass == Pass::kLight || pass == Pass::kLightRest || pass == Pass::kRestAlone;
    gl.DepthFunc(sorted                                          ? GL_LESS
                 : pass == Pass::kLightOne                       ? severalSamples ? GL_EQUAL : GL_LEQUAL
                 : pass == Pass::kBlend || pass == Pass::kShadow ? GL_GREATER
                                                                 : GL_ALWAYS);
    const bool mixes = pass == Pass::kLightRest || pass == Pass::kBlend;
    mixes ? gl.Enable(GL_BLEND) : gl.Disable(GL_BLEND);
    // Alpha of what is transparent adds up from 0, so that it tells where anything was blended: the rest of the picture
    // stays as it is, to the bit.
    if (pass == Pass::kLightRest) gl.BlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ZERO, GL_ONE);
    if (pass == Pass::kBlend) gl.BlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE);
    return {};
}

Expected<void> Renderer::Impl::drawOver(Pass pass, std::span<const PixelRect> parts) {
    const ProgramKind kind = kindOf(useOf(pass));
    if (parts.empty()) {
        if (!drawnWith.contains({pass, kind})) {
            expect(pass, kind, 0);
            expectKin(pass, kind, 0);
        }
        return {};
    }
    if (auto wanted = goOn(); !wanted) return wanted;
    if (auto entered = enter(pass); !entered) return entered;
    if (auto used = useProgram(kind); !used) return used;
    gl.BindVertexArray(emptyArray);
    gl.Disable(GL_CULL_FACE);
    for (const PixelRect& part : parts) {
        gl.Scissor(part.x, part.y, part.width, part.height);
        gl.DrawArrays(GL_TRIANGLES, 0, 3);
    }
    met(pass, kind, 0);
    return {};
}

/// Of one sample a surface is read only where its depth says that there is one; unless the background is a picture,
/// which is lit as surfaces are. Mesa fills depth alone faster than parts of it are drawn over, where they are most of
/// it. Colours of 64 bits it fills by a call for each sample: drawing over all of them takes half of that time.
Expected<void> Renderer::Impl::clearSurfaces(GLuint framebuffer) {
    if (samples > 1) return drawOver(Pass::kClear, shown);
    std::int64_t covered = 0;
    for (const PixelRect& part : shown) covered += std::int64_t{part.width} * part.height;
    const bool depthAlone = !backgroundIsLit();
    if (auto expected = drawOver(depthAlone ? Pass::kClear : Pass::kClearDepth, {}); !expected) return expected;
    if (!depthAlone || 3 * covered < 2 * std::int64_t{tile.widthPx()} * tile.heightPx())
        return drawOver(depthAlone ? Pass::kClearDepth : Pass::kClear, shown);
    if (auto expected = drawOver(Pass::kClearDepth, {}); !expected) return expected;
    const float farthest = 0;
    gl.Disable(GL_SCISSOR_TEST);
    gl.ClearNamedFramebufferfv(framebuffer, GL_DEPTH, 0, &farthest);
    gl.Enable(GL_SCISSOR_TEST);
    return {};
}

/// Each pixel is lit once, however many surfaces were drawn into it, and once more where its samples show different
/// ones. Where something will be blended over the picture each sample gets the colour that it shows.
Expected<void> Renderer::Impl::lightSurfaces() {
    const auto picture = tile.picture();
    if (!picture) return tl::unexpected(picture.error());
    gl.Disable(GL_SCISSOR_TEST);
    gl.ClearNamedFramebufferfv(*picture, GL_COLOR, 0, background.data());
    gl.Enable(GL_SCISSOR_TEST);
    if (samples == 1) return drawOver(Pass::kLightOne, shown);
    for (const Pass pass : {Pass::kClassify, Pass::kLightOne, Pass::kLight})
        if (auto lit = drawOver(pass, shown); !lit) return lit;
    if (auto copied = drawOver(Pass::kCopy, blending); !copied) return copied;
    if (!blending.empty()) {
        const auto rest = tile.rest();
        if (!rest) return tl::unexpected(rest.error());
        const std::array<GLfloat, 4> nothing{};
        gl.Disable(GL_SCISSOR_TEST);
        gl.ClearNamedFramebufferfv(*rest, GL_COLOR, 0, nothing.data());
        gl.Enable(GL_SCISSOR_TEST);
    }
    if (auto lit = drawOver(Pass::kRestAlone, blending); !lit) return lit;
    return drawOver(Pass::kLightRest, shown);
}

/// What is solid, as the first of its samples has it; what is transparent is looked through.
Expected<void> Renderer::Impl::meter(const CellPart& cell) {
    constexpr int kSide = LightHistogram::kSquarePx;
    static_assert(kCellWidthPx % kSide == 0 && kCellHeightPx % kSide == 0, "a square lies in one cell");
    const auto squaresOf = [](const PixelRect& of) {
        const int left = LightHistogram::squareFrom(of.x), bottom = LightHistogram::squareFrom(of.y);
        return PixelRect{.x = left,
                         .y = bottom,
                         .width = LightHistogram::squareFrom(of.x + of.width) - left,
                         .height = LightHistogram::squareFrom(of.y + of.height) - bottom};
    };
    const PixelRect own = squaresOf(cell.inCell);
    if (own.width == 0 || own.height == 0) return {};
    const auto framebuffer = tile.meter();
    if (!framebuffer) return tl::unexpected(framebuffer.error());
    const std::array<GLuint, 4> nothing{};
    gl.Disable(GL_SCISSOR_TEST);
    gl.ClearNamedFramebufferuiv(*framebuffer, GL_COLOR, 0, nothing.data());
    gl.Enable(GL_SCISSOR_TEST);
    std::vector<PixelRect> parts;
    for (const PixelRect& part : shown)
        if (const PixelRect squares = squaresOf(part); squares.width > 0 && squares.height > 0)
            parts.push_back(squares);
    gl.Viewport(0, 0, kCellWidthPx / kSide, kCellHeightPx / kSide);
    const auto drawn = drawOver(Pass::kMeter, parts);
    gl.Viewport(0, 0, cell.camera.pixels.width, cell.camera.pixels.height);
    if (!drawn) return drawn;
    const int toScreenX = (cell.onScreen.x - cell.inCell.x) / kSide,
              toScreenY = (cell.onScreen.y - cell.inCell.y) / kSide;
    MeteredCell& read = metered.emplace_back();
    read = {.left = own.x + toScreenX, .bottom = own.y + toScreenY, .columns = own.width, .rows = own.height};
    read.pitch = (static_cast<std::size_t>(own.width) + 3) / 4 * 4;
    read.classes.resize(read.pitch * static_cast<std::size_t>(own.height));
    gl.BindFramebuffer(GL_READ_FRAMEBUFFER, *framebuffer);
    const GlState::Pixels layout(gl, {.packRowPx = static_cast<int>(read.pitch)});
    gl.ReadPixels(own.x, own.y, own.width, own.height, GL_RED_INTEGER, GL_UNSIGNED_BYTE, read.classes.data());
    return {};
}

void Renderer::Impl::bindSurfaces() {
    gl.BindTextureUnit(0, tile.surfaceTexture());
    gl.BindTextureUnit(1, tile.depthTexture());
    gl.BindTextureUnit(2, looks.materialTexture());
    if (scene.detail) gl.BindTextureUnit(kDetailUnit, tile.detailTexture());
    lights.bind(kLightUnit, kListUnit);
    surroundings.bind(kSurroundingsUnit);
    shadows.bind(kShadowUnit);
}

Expected<void> Renderer::Impl::blendTransparent() {
    const bool severalSamples = samples > 1;
    if (severalSamples)
        if (auto spread = drawOver(Pass::kSpread, blending); !spread) return spread;
    if (!blending.empty()) {
        if (auto entered = enter(Pass::kBlend); !entered) return entered;
        gl.Scissor(scissor.x, scissor.y, scissor.width, scissor.height);
        if (auto drawn = issue(calls.opaqueCount(), calls.calls().size(), ProgramKind::Use::kBlend); !drawn)
            return drawn;
    }
    return severalSamples ? drawOver(Pass::kResolve, blending) : Expected<void>();
}

}  // namespace tessera
