/// The lights of a frame and the lists of a cell, where shaders read them.
#pragma once

#include <optional>
#include <vector>

#include "client/draw/passes/LightClusters.h"
#include "client/draw/passes/ShadowMaps.h"
#include "client/draw/shaders/Program.h"
#include "client/draw/surface/GlState.h"

namespace tessera {

/// Belongs to the surface's thread.
class LightBuffers {
public:
    explicit LightBuffers(GlState& gl);
    /// The surface is current, or gone.
    ~LightBuffers();
    LightBuffers(const LightBuffers&) = delete;
    LightBuffers& operator=(const LightBuffers&) = delete;

    /// `shadowViews`: what ShadowMaps says of the lights with shadows; none: they have none. Tiles of one screen in one
    /// frame have the same lights: what is there is not made again.
    /// `everywhere`: every light is everybody's (RendererOptions::clusterLights).
    [[nodiscard]] LightLists begin(std::span<const LightItem> lights, const ScreenCamera& camera,
                                   const ShadowMaps::Texels& shadowViews, bool everywhere);
    /// Where shaders find the lights with shadows, in texels; how many there are.
    [[nodiscard]] std::array<float, 2> shadowed() const {
        return {static_cast<float>(4 * clusters_.lights().size()), static_cast<float>(clusters_.shadowed().size())};
    }
    /// Whether a light with shadows shines to all sides.
    [[nodiscard]] bool cubes() const { return cubes_; }
    /// Whether there is one light alone, and that is a sun with shadows.
    [[nodiscard]] bool oneSun() const {
        return clusters_.shadowed().size() == 1 && clusters_.shadowed()[0].place[3] == 0 && !clusters_.hasLists() &&
               clusters_.everywhere() == 0;
    }
    /// Whether a light of `begin`'s has a scope.
    [[nodiscard]] bool scoped() const { return scoped_; }
    /// Where `begin` said kSun or kSuns: they; those that there are not are dark.
    [[nodiscard]] const std::array<Sun, kMostSuns>& suns() const { return suns_; }
    /// Where `begin` said kFew.
    [[nodiscard]] const FewLights& few() const { return few_; }
    /// Uploads the cell's lists; what FrameBlock::slices says.
    [[nodiscard]] std::array<float, 4> beginCell(const ScreenCamera& cell, const PixelRect& scissor);
    void bind(GLuint lightUnit, GLuint listUnit) const;

private:
    /// False: there are others, or more.
    [[nodiscard]] bool findSuns();
    [[nodiscard]] bool findFew();
    /// Of what is noted.
    [[nodiscard]] LightLists collect();

    GlState& gl_;
    LightClusters clusters_;
    std::array<Sun, kMostSuns> suns_{};
    FewLights few_{};
    bool scoped_ = false, isFew_ = false, cubes_ = false;
    // What there is, and of what.
    LightLists kind_ = LightLists::kAll;
    bool everywhere_ = false;
    std::vector<LightItem> of_;
    std::optional<ScreenCamera> seenFrom_;
    ShadowMaps::Texels shadowViews_;
    std::vector<std::array<float, 4>> texels_;
    GLuint lightBuffer_ = 0, listBuffer_ = 0, lightTexture_ = 0, listTexture_ = 0;
};

}  // namespace tessera
