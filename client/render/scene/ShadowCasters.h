/// What stands in the way of the lights that have shadows. Follows from the scene and the user's head, what is finest
/// from a screen's eye: the same on every tile of the screen, and the same as before while the head moves a little.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "client/render/DrawList.h"
#include "client/render/scene/CasterPieces.h"

namespace tessera {

/// Of a view, what has not moved for a while.
struct StillCasters {
    CasterPieces all;
    StillChanges changes;  ///< where their depths are others than before
};

/// A light's own look at the scene, of which its shadows are made. Its map holds the depths nearest to the light: the
/// same numbers in whatever order, and however often, its casters are drawn.
struct ShadowView {
    ScreenCamera camera;    ///< from the light; eye space in world units; as many pixels as its map has
    bool clamped = false;   ///< what is before its depths shades as if it stood at their front
    std::uint64_t kin = 0;  ///< views of one kin have one camera, and differ in `state` alone
    std::uint64_t state = 0;
    /// Solid things that the light may see, no lines, nothing of the server's own: those that rest, and others.
    std::shared_ptr<const StillCasters> still;
    std::vector<ShadowCaster> moving;
};

/// The sides of a cube around a point light that shines through each of them: of two that are opposite, the one along
/// an axis of the world comes first.
inline constexpr std::size_t kCubeViews = 6;

struct ShadowCasters {
    /// One for each light of the list that has `shadows`, in the list's order; kCubeViews of a point light. The same
    /// one as before, as long as it is the same view of the same things.
    std::vector<std::shared_ptr<const ShadowView>> views;
    std::vector<std::size_t> firstOf;  ///< by light that has shadows: its first one
    /// Finer ones of the directional light, each null where it is none: of what lies within kNearMetres of the screen's
    /// eye, and within kMiddleMetres of the head. `views` has what lies within kFarMetres, or as much as there is.
    std::shared_ptr<const ShadowView> near, middle;
    std::size_t sun = 0;  ///< the directional light's, among `views`
    /// How many views a light has, whose first one is this.
    [[nodiscard]] std::size_t countOf(std::size_t light) const {
        return (light + 1 < firstOf.size() ? firstOf[light + 1] : views.size()) - firstOf[light];
    }

    /// All of them: `views`, `middle`, `near`, those that there are.
    [[nodiscard]] std::vector<std::shared_ptr<const ShadowView>> all() const;
};
inline constexpr double kNearMetres = 7, kMiddleMetres = 64, kFarMetres = 1000;

/// Where things take shadows: a cube in the world around a place. In steps of a fifth of a reach of `metres`, so that
/// it stays while that place moves a little.
[[nodiscard]] Box shadedAround(const Vec3d& place, double metres, double unitsPerMetre);

/// Sides of their maps, in pixels; of a point light's too.
inline constexpr int kSunMapPx = 2048, kSpotMapPx = 1024;

/// Of a directional light all of `shaded`, in steps, so that the map's pixels stay where they are as long as its size
/// changes little; of a spot its cone, up to 80 degrees from its axis, from a thousandth of its range or of how far
/// `shaded` reaches; of a point light all that lies nearer to this axis than to others, and a few pixels around.
[[nodiscard]] ScreenCamera shadowCamera(const LightItem& light, const Box& shaded, std::size_t side = 0);
/// `sun`'s look at what is near the eye of a screen: in steps, so that it stays while the eye moves a little.
[[nodiscard]] std::optional<ScreenCamera> nearShadowCamera(const ScreenCamera& sun, const ScreenCamera& screen);

}  // namespace tessera
