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
    /// frame have the same lights, and eyes or screens in turn those of their last turn: what one of the last
    /// kKept cameras was given is not made again.
    /// `everywhere`: every light is everybody's (RendererOptions::clusterLights).
    [[nodiscard]] LightLists begin(std::span<const LightItem> lights, const ScreenCamera& camera,
                                   const ShadowMaps::Texels& shadowViews, bool everywhere);
    static constexpr std::size_t kKept = 8;
    /// How often they were made.
    [[nodiscard]] std::uint64_t prepared() const { return prepared_; }
    /// Where shaders find the lights with shadows, in texels; how many there are.
    [[nodiscard]] std::array<float, 2> shadowed() const {
        const LightClusters& clusters = now().clusters;
        return {static_cast<float>(4 * clusters.lights().size()), static_cast<float>(clusters.shadowed().size())};
    }
    /// Whether a light with shadows shines to all sides.
    [[nodiscard]] bool cubes() const { return !now().shadowViews.cubes.empty(); }
    /// Whether there is one light alone, and that is a sun with shadows.
    [[nodiscard]] bool oneSun() const {
        const LightClusters& clusters = now().clusters;
        return clusters.shadowed().size() == 1 && clusters.shadowed()[0].place[3] == 0 && !clusters.hasLists() &&
               clusters.everywhere() == 0;
    }
    /// Whether a light of `begin`'s has a scope.
    [[nodiscard]] bool scoped() const { return now().scoped; }
    /// Where `begin` said kSun or kSuns: they; those that there are not are dark.
    [[nodiscard]] const std::array<Sun, kMostSuns>& suns() const { return now().suns; }
    /// Where `begin` said kFew.
    [[nodiscard]] const FewLights& few() const { return now().few; }
    /// Uploads the cell's lists; what FrameBlock::slices says.
    [[nodiscard]] std::array<float, 4> beginCell(const ScreenCamera& cell, const PixelRect& scissor);
    void bind(GLuint lightUnit, GLuint listUnit) const;

private:
    /// What was made, and of what.
    struct Made {
        LightClusters clusters;
        std::array<Sun, kMostSuns> suns{};
        FewLights few{};
        bool scoped = false;
        LightLists kind = LightLists::kAll;
        GLuint buffer = 0, texture = 0;
        std::uint64_t lastUse = 0;
        bool everywhere = false;
        std::vector<LightItem> of;
        std::optional<ScreenCamera> seenFrom;
        ShadowMaps::Texels shadowViews;
    };
    [[nodiscard]] const Made& now() const { return made_[now_]; }
    /// The one that has not been used for longest; another one as long as there may be more.
    [[nodiscard]] std::size_t oldest();
    /// Of what is noted.
    [[nodiscard]] LightLists collect(Made& made);
    /// False: there are others, or more.
    [[nodiscard]] static bool findSuns(Made& made);
    [[nodiscard]] static bool findFew(Made& made);

    GlState& gl_;
    std::vector<Made> made_;
    std::size_t now_ = 0;
    std::uint64_t begun_ = 0, prepared_ = 0;
    std::vector<std::array<float, 4>> texels_;
    GLuint listBuffer_ = 0, listTexture_ = 0;
};

}  // namespace tessera
