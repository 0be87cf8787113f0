/// The depths that lights see, in one texture.
#pragma once

#include <memory>

#include "client/draw/GlFunctions.h"
#include "client/draw/LightClusters.h"
#include "client/render/ShadowCasters.h"

namespace tessera {

/// Maps lie one above the other: first those of 2048 pixels a side, then those of 1024, two in a row. Belongs to the surface's
/// thread.
class ShadowMaps {
public:
    static constexpr std::size_t kTexels = 12;

    explicit ShadowMaps(const GlFunctions& gl);
    /// The surface is current, or gone.
    ~ShadowMaps();
    ShadowMaps(const ShadowMaps&) = delete;
    ShadowMaps& operator=(const ShadowMaps&) = delete;

    /// Makes room, and names the views that must be drawn: those that are not there yet.
    [[nodiscard]] Expected<std::vector<std::size_t>> begin(std::shared_ptr<const ShadowCasters> casters);
    [[nodiscard]] const ShadowView& view(std::size_t index) const { return *views_[index]; }
    void setDrawn(std::size_t index) { drawn_[index] = views_[index]; }
    [[nodiscard]] GLuint framebuffer() const { return framebuffer_; }
    /// Where the map of a view lies.
    [[nodiscard]] PixelRect place(std::size_t view) const { return places_[view]; }
    /// What shaders read of each light besides itself, kTexels each: of its view, and of the finer one or the same again (LightShader.cpp): a matrix, by rows, from the screen's eye space to
    /// the texture and depth, all times w; how large a pixel of the map is (at w = 0, and for each w more), in metres; the
    /// rectangle.
    [[nodiscard]] std::vector<std::array<float, 4>> texels(const ScreenCamera& camera) const;
    [[nodiscard]] std::array<float, 2> pixelSize() const { return {1.0f / kWidthPx, 1.0f / static_cast<float>(heightPx_)}; }
    void bind(GLuint unit) const;
    [[nodiscard]] std::size_t bytes() const { return std::size_t{4} * kWidthPx * static_cast<std::size_t>(heightPx_); }

private:
    static constexpr int kWidthPx = 2048;
    [[nodiscard]] Expected<void> reach(int heightPx);
    void addTexels(std::size_t view, const ScreenCamera& camera, std::vector<std::array<float, 4>>& texels) const;

    const GlFunctions& gl_;
    GLuint texture_ = 0, sampler_ = 0, framebuffer_ = 0;
    int heightPx_ = 0;
    std::vector<PixelRect> places_;
    std::shared_ptr<const ShadowCasters> casters_;
    std::vector<std::shared_ptr<const ShadowView>> views_, drawn_;  ///< the finer one is the last
};

}  // namespace tessera
