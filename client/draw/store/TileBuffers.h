/// Framebuffers that a tile is drawn into.
#pragma once

#include "client/draw/surface/GlFunctions.h"

namespace tessera {

/// Grow to what is asked for, never shrink. 64 bits (a packed surface, or a node's id) and depth per sample, and 64
/// more where images say more of a surface; the picture; and for what is blended over it a picture of several samples,
/// and one of the second colours of pixels. Made when first needed. What has one sample is a rectangle texture.
class TileBuffers {
public:
    /// `samples`: 1 or 4.
    TileBuffers(const GlFunctions& gl, int samples) : gl_(gl), samples_(samples) {}
    ~TileBuffers();
    TileBuffers(const TileBuffers&) = delete;
    TileBuffers& operator=(const TileBuffers&) = delete;

    /// As above. Where they are others than before, all is made anew.
    void useSamples(int samples);
    /// Room for the pixels [0, widthPx) x [0, heightPx).
    [[nodiscard]] Expected<void> reach(int widthPx, int heightPx);

    [[nodiscard]] int widthPx() const { return widthPx_; }
    [[nodiscard]] int heightPx() const { return heightPx_; }

    /// Framebuffer of 2 x 32 bits unsigned and depth, and its two textures (of several samples, where there are).
    [[nodiscard]] GLuint surfaces() const { return surfaces_; }
    /// The same with 2 x 32 bits more as its second colour, and that one's texture.
    [[nodiscard]] Expected<GLuint> detailedSurfaces();
    [[nodiscard]] GLuint detailTexture() const { return detailTexture_; }
    [[nodiscard]] GLuint surfaceTexture() const { return surfaceTexture_; }
    [[nodiscard]] GLuint depthTexture() const { return depthTexture_; }
    /// Framebuffer of the picture, one sample, with a depth of its own.
    [[nodiscard]] Expected<GLuint> picture();
    [[nodiscard]] GLuint pictureTexture() const { return pictureTexture_; }
    /// Framebuffer with the surfaces' depth; with one sample its colour is the picture itself.
    [[nodiscard]] Expected<GLuint> blended();
    [[nodiscard]] GLuint blendedTexture() const { return blendedTexture_; }
    /// Framebuffer of a picture with the depth of `picture`.
    [[nodiscard]] Expected<GLuint> rest();
    [[nodiscard]] GLuint restTexture() const { return restTexture_; }
    /// Framebuffer of 8 bits unsigned for each square of LightHistogram.
    [[nodiscard]] Expected<GLuint> meter();
    /// Of all that are made.
    [[nodiscard]] std::size_t bytes() const;

private:
    [[nodiscard]] GLuint makeTexture(GLenum format, int samples) const;
    [[nodiscard]] Expected<void> check(GLuint framebuffer) const;
    void destroy();

    const GlFunctions& gl_;
    int samples_;
    int widthPx_ = 0, heightPx_ = 0;
    GLuint surfaces_ = 0, detailedSurfaces_ = 0, picture_ = 0, blended_ = 0, rest_ = 0, meter_ = 0;
    GLuint surfaceTexture_ = 0, depthTexture_ = 0, pictureTexture_ = 0, blendedTexture_ = 0, restTexture_ = 0;
    GLuint detailTexture_ = 0, meterTexture_ = 0;
    GLuint pictureDepth_ = 0;
};

}  // namespace tessera
