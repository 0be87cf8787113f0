#include "client/draw/RenderTarget.h"

#include <algorithm>

namespace tessera {
namespace {

constexpr int kMaxSidePx = 16384;

}  // namespace

RenderTarget::~RenderTarget() {
    destroy(drawn_);
    destroy(resolved_);
}

Expected<void> RenderTarget::reach(int widthPx, int heightPx) {
    if (widthPx <= widthPx_ && heightPx <= heightPx_) return {};
    if (widthPx > kMaxSidePx || heightPx > kMaxSidePx)
        return fail(ErrorCode::kLimit, "a screen of more than 16384 pixels a side cannot be drawn");
    widthPx_ = std::max(widthPx, widthPx_);
    heightPx_ = std::max(heightPx, heightPx_);
    // Rows a power of two apart fall into the same cache sets.
    if (widthPx_ % 512 == 0 && widthPx_ < kMaxSidePx) widthPx_ += 64;
    destroy(drawn_);
    destroy(resolved_);
    drawn_ = make(samples_, true);
    if (samples_ > 1) resolved_ = make(1, false);
    if (auto good = gl_.check("making a framebuffer"); !good) return good;
    const GLenum status = gl_.CheckNamedFramebufferStatus(drawn_.framebuffer, GL_DRAW_FRAMEBUFFER);
    if (status != GL_FRAMEBUFFER_COMPLETE)
        return fail(ErrorCode::kUnsupported, "the surface cannot draw into a framebuffer of " + std::to_string(widthPx_) +
                                                 "x" + std::to_string(heightPx_) + " with " + std::to_string(samples_) +
                                                 " samples");
    return {};
}

GLuint RenderTarget::resolve(int x, int y, int widthPx, int heightPx) {
    if (samples_ == 1) return drawn_.framebuffer;
    gl_.BlitNamedFramebuffer(drawn_.framebuffer, resolved_.framebuffer, x, y, x + widthPx, y + heightPx, x, y, x + widthPx,
                             y + heightPx, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    return resolved_.framebuffer;
}

RenderTarget::Buffers RenderTarget::make(int samples, bool withDepth) const {
    Buffers buffers;
    const GLsizei storedSamples = samples > 1 ? samples : 0;
    gl_.CreateFramebuffers(1, &buffers.framebuffer);
    gl_.CreateRenderbuffers(1, &buffers.color);
    gl_.NamedRenderbufferStorageMultisample(buffers.color, storedSamples, colorFormat_, widthPx_, heightPx_);
    gl_.NamedFramebufferRenderbuffer(buffers.framebuffer, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, buffers.color);
    if (withDepth) {
        gl_.CreateRenderbuffers(1, &buffers.depth);
        gl_.NamedRenderbufferStorageMultisample(buffers.depth, storedSamples, GL_DEPTH_COMPONENT32F, widthPx_, heightPx_);
        gl_.NamedFramebufferRenderbuffer(buffers.framebuffer, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, buffers.depth);
    }
    return buffers;
}

void RenderTarget::destroy(Buffers& buffers) const {
    if (buffers.framebuffer) gl_.DeleteFramebuffers(1, &buffers.framebuffer);
    if (buffers.color) gl_.DeleteRenderbuffers(1, &buffers.color);
    if (buffers.depth) gl_.DeleteRenderbuffers(1, &buffers.depth);
    buffers = {};
}

}  // namespace tessera
