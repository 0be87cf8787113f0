/// The depths that lights see, in one texture.
#pragma once

#include <memory>

#include "client/draw/passes/LightClusters.h"
#include "client/draw/surface/GlState.h"
#include "client/render/scene/ShadowCasters.h"

namespace tessera {

/// Layers of 2048 pixels a side: first of one map each, then of four maps of 1024. So where a map lies in its layer,
/// and all that is computed from it, does not depend on how many there are. Belongs to the surface's thread.
class ShadowMaps {
public:
    static constexpr std::size_t kTexels = 18;

    explicit ShadowMaps(GlState& gl);
    /// The surface is current, or gone.
    ~ShadowMaps();
    ShadowMaps(const ShadowMaps&) = delete;
    ShadowMaps& operator=(const ShadowMaps&) = delete;

    /// Makes room, and names the views that must be drawn: those that are not there yet.
    [[nodiscard]] Expected<std::vector<std::size_t>> begin(std::shared_ptr<const ShadowCasters> casters);
    [[nodiscard]] const ShadowView& view(std::size_t index) const { return *views_[index]; }
    void setDrawn(std::size_t index) { drawn_[index] = views_[index]; }
    /// Of the layer that a view's map is in, until the next call.
    void attach(std::size_t view);
    [[nodiscard]] GLuint framebuffer() const { return framebuffer_; }
    /// Where the map of a view lies in its layer.
    [[nodiscard]] PixelRect place(std::size_t view) const { return places_[view].rect; }
    /// What shaders read of each light besides itself, kTexels each: of three views, the finest first, where there is
    /// none the next one again (Lighting.glsl): a matrix, by rows, from the screen's eye space to the texture and
    /// depth, all times w; how large a pixel of the map is (at w = 0, and for each w more), in metres, and the layer;
    /// the rectangle.
    [[nodiscard]] std::vector<std::array<float, 4>> texels(const ScreenCamera& camera) const;
    [[nodiscard]] static std::array<float, 2> pixelSize() { return {1.0f / kSunMapPx, 1.0f / kSunMapPx}; }
    void bind(GLuint unit) const;
    [[nodiscard]] std::size_t bytes() const {
        return std::size_t{4} * kSunMapPx * kSunMapPx * static_cast<std::size_t>(layers_);
    }

private:
    struct Place {
        int layer = 0;
        PixelRect rect;
        bool operator==(const Place&) const = default;
    };
    void makeTexture(int sidePx, int layers);
    [[nodiscard]] Expected<void> reach(int layers);
    void addTexels(std::size_t view, const ScreenCamera& camera, std::vector<std::array<float, 4>>& texels) const;

    GlState& gl_;
    GLuint texture_ = 0, sampler_ = 0, framebuffer_ = 0;
    int layers_ = 0;
    std::vector<Place> places_;
    std::shared_ptr<const ShadowCasters> casters_;
    std::vector<std::shared_ptr<const ShadowView>> views_, drawn_;  ///< the sun's finer ones are the last
    std::size_t middle_ = 0, near_ = 0;                             ///< among them; the sun's own where there is none
};

}  // namespace tessera
