/// Framebuffer objects that pictures are drawn into.
#pragma once

#include <array>

#include "client/draw/GlFunctions.h"

namespace tessera {

/// Colour and depth of at least a wanted size, and, when there are several samples per pixel, a second framebuffer for
/// their means. Grows, never shrinks.
class RenderTarget {
public:
    /// `colorFormat`: GL_RGBA8 or GL_RG32UI; samples 1 or 4.
    RenderTarget(const GlFunctions& gl, GLenum colorFormat, int samples)
        : gl_(gl), colorFormat_(colorFormat), samples_(samples) {}
    ~RenderTarget();
    RenderTarget(const RenderTarget&) = delete;
    RenderTarget& operator=(const RenderTarget&) = delete;

    /// Room for the pixels [0, widthPx) x [0, heightPx).
    [[nodiscard]] Expected<void> reach(int widthPx, int heightPx);
    /// Where to draw.
    [[nodiscard]] GLuint framebuffer() const { return drawn_.framebuffer; }
    /// Where to read, after the rectangle's samples have been averaged there.
    [[nodiscard]] GLuint resolve(int x, int y, int widthPx, int heightPx);

private:
    struct Buffers {
        GLuint framebuffer = 0, color = 0, depth = 0;
    };
    Buffers make(int samples, bool withDepth) const;
    void destroy(Buffers& buffers) const;

    const GlFunctions& gl_;
    GLenum colorFormat_;
    int samples_;
    int widthPx_ = 0, heightPx_ = 0;
    Buffers drawn_, resolved_;
};

}  // namespace tessera
