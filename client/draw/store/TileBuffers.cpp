#include "client/draw/store/TileBuffers.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <utility>

#include "common/wall/LightHistogram.h"

namespace tessera {

TileBuffers::~TileBuffers() {
    destroy();
}

void TileBuffers::useSamples(int samples) {
    if (std::exchange(samples_, samples) == samples) return;
    destroy();
    widthPx_ = heightPx_ = 0;
}

Expected<void> TileBuffers::reach(int widthPx, int heightPx) {
    if (widthPx <= widthPx_ && heightPx <= heightPx_) return {};
    widthPx_ = std::max(widthPx, widthPx_);
    heightPx_ = std::max(heightPx, heightPx_);
    // Rows a power of two apart fall into the same cache sets. And llvmpipe compiles a program anew for textures whose
    // sides are powers of two: so no side is, and what is compiled for a small picture serves a large one.
    if (widthPx_ % 512 == 0) widthPx_ += 64;
    for (int* side : {&widthPx_, &heightPx_})
        while (std::has_single_bit(static_cast<unsigned>(*side))) *side += 64;
    destroy();
    surfaceTexture_ = makeTexture(GL_RG32UI, samples_);
    depthTexture_ = makeTexture(GL_DEPTH_COMPONENT32F, samples_);
    gl_.CreateFramebuffers(1, &surfaces_);
    gl_.NamedFramebufferTexture(surfaces_, GL_COLOR_ATTACHMENT0, surfaceTexture_, 0);
    gl_.NamedFramebufferTexture(surfaces_, GL_DEPTH_ATTACHMENT, depthTexture_, 0);
    return check(surfaces_);
}

Expected<GLuint> TileBuffers::detailedSurfaces() {
    if (detailedSurfaces_) return detailedSurfaces_;
    detailTexture_ = makeTexture(GL_RG32UI, samples_);
    gl_.CreateFramebuffers(1, &detailedSurfaces_);
    gl_.NamedFramebufferTexture(detailedSurfaces_, GL_COLOR_ATTACHMENT0, surfaceTexture_, 0);
    gl_.NamedFramebufferTexture(detailedSurfaces_, GL_COLOR_ATTACHMENT1, detailTexture_, 0);
    gl_.NamedFramebufferTexture(detailedSurfaces_, GL_DEPTH_ATTACHMENT, depthTexture_, 0);
    const std::array<GLenum, 2> both = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
    gl_.NamedFramebufferDrawBuffers(detailedSurfaces_, static_cast<GLsizei>(both.size()), both.data());
    if (auto good = check(detailedSurfaces_); !good) return tl::unexpected(good.error());
    return detailedSurfaces_;
}

Expected<GLuint> TileBuffers::picture() {
    if (picture_) return picture_;
    pictureTexture_ = makeTexture(GL_RGBA8, 1);
    gl_.CreateRenderbuffers(1, &pictureDepth_);
    gl_.NamedRenderbufferStorageMultisample(pictureDepth_, 0, GL_DEPTH_COMPONENT32F, widthPx_, heightPx_);
    gl_.CreateFramebuffers(1, &picture_);
    gl_.NamedFramebufferTexture(picture_, GL_COLOR_ATTACHMENT0, pictureTexture_, 0);
    gl_.NamedFramebufferRenderbuffer(picture_, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, pictureDepth_);
    if (auto good = check(picture_); !good) return tl::unexpected(good.error());
    return picture_;
}

Expected<GLuint> TileBuffers::blended() {
    if (blended_) return blended_;
    if (samples_ > 1) blendedTexture_ = makeTexture(GL_RGBA8, samples_);
    gl_.CreateFramebuffers(1, &blended_);
    gl_.NamedFramebufferTexture(blended_, GL_COLOR_ATTACHMENT0, samples_ > 1 ? blendedTexture_ : pictureTexture_, 0);
    gl_.NamedFramebufferTexture(blended_, GL_DEPTH_ATTACHMENT, depthTexture_, 0);
    if (auto good = check(blended_); !good) return tl::unexpected(good.error());
    return blended_;
}

Expected<GLuint> TileBuffers::rest() {
    if (rest_) return rest_;
    if (auto made = picture(); !made) return made;
    restTexture_ = makeTexture(GL_RGBA8, 1);
    gl_.CreateFramebuffers(1, &rest_);
    gl_.NamedFramebufferTexture(rest_, GL_COLOR_ATTACHMENT0, restTexture_, 0);
    gl_.NamedFramebufferRenderbuffer(rest_, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, pictureDepth_);
    if (auto good = check(rest_); !good) return tl::unexpected(good.error());
    return rest_;
}

Expected<GLuint> TileBuffers::meter() {
    if (meter_) return meter_;
    constexpr int kSide = LightHistogram::kSquarePx;
    gl_.CreateTextures(GL_TEXTURE_RECTANGLE, 1, &meterTexture_);
    gl_.TextureStorage2D(meterTexture_, 1, GL_R8UI, widthPx_ / kSide + 1, heightPx_ / kSide + 1);
    gl_.CreateFramebuffers(1, &meter_);
    gl_.NamedFramebufferTexture(meter_, GL_COLOR_ATTACHMENT0, meterTexture_, 0);
    if (auto good = check(meter_); !good) return tl::unexpected(good.error());
    return meter_;
}

std::size_t TileBuffers::bytes() const {
    const auto pixels = static_cast<std::size_t>(widthPx_) * static_cast<std::size_t>(heightPx_);
    const auto samples = static_cast<std::size_t>(samples_);
    return pixels * ((surfaces_ ? 12 * samples : 0) + (detailedSurfaces_ ? 8 * samples : 0) + (picture_ ? 8 : 0) +
                     (blendedTexture_ ? 4 * samples : 0) + (rest_ ? 4 : 0));
}

GLuint TileBuffers::makeTexture(GLenum format, int samples) const {
    GLuint texture = 0;
    if (samples > 1) {
        gl_.CreateTextures(GL_TEXTURE_2D_MULTISAMPLE, 1, &texture);
        gl_.TextureStorage2DMultisample(texture, samples, format, widthPx_, heightPx_, GL_TRUE);
        return texture;
    }
    gl_.CreateTextures(GL_TEXTURE_RECTANGLE, 1, &texture);
    gl_.TextureStorage2D(texture, 1, format, widthPx_, heightPx_);
    gl_.TextureParameteri(texture, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    gl_.TextureParameteri(texture, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    return texture;
}

Expected<void> TileBuffers::check(GLuint framebuffer) const {
    if (auto good = gl_.check("making a framebuffer"); !good) return good;
    if (gl_.CheckNamedFramebufferStatus(framebuffer, GL_DRAW_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE) return {};
    return fail(ErrorCode::kUnsupported,
                fmt::format("the surface cannot draw into a framebuffer of {}x{} with {} samples", widthPx_, heightPx_,
                            samples_));
}

void TileBuffers::destroy() {
    for (GLuint* framebuffer : {&surfaces_, &detailedSurfaces_, &picture_, &blended_, &rest_, &meter_}) {
        if (*framebuffer) gl_.DeleteFramebuffers(1, framebuffer);
        *framebuffer = 0;
    }
    for (GLuint* texture : {&surfaceTexture_, &detailTexture_, &depthTexture_, &pictureTexture_, &blendedTexture_,
                            &restTexture_, &meterTexture_}) {
        if (*texture) gl_.DeleteTextures(1, texture);
        *texture = 0;
    }
    if (pictureDepth_) gl_.DeleteRenderbuffers(1, &pictureDepth_);
    pictureDepth_ = 0;
}

}  // namespace tessera
