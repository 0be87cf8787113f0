/// What stands in the way of the lights that have shadows. Follows from the scene and the user's head, what is finest
/// from a screen's eye: the same on every tile of the screen, and the same as before while the head moves a little.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "client/render/DrawList.h"

namespace tessera {

/// A light's own look at the scene, of which its shadows are made.
struct ShadowView {
    ScreenCamera camera;  ///< from the light; eye space in world units; as many pixels as its map has
    std::vector<DrawItem>
        items;  ///< solid things that it may see, in no particular order; no lines, nothing of the server's own
    bool clamped = false;  ///< what is before its depths shades as if it stood at their front
};

struct ShadowCasters {
    /// One for each light of the list that has `shadows`, in the list's order. The same one as before, as long as it is
    /// the same view of the same scene.
    std::vector<std::shared_ptr<const ShadowView>> views;
    /// Finer ones of the directional light, each null where it is none: of what lies within kNearMetres of the screen's
    /// eye, and within kMiddleMetres of the head. `views` has what lies within kFarMetres, or as much as there is.
    std::shared_ptr<const ShadowView> near, middle;
    std::size_t sun = 0;  ///< the directional light, among `views`
};
inline constexpr double kNearMetres = 7, kMiddleMetres = 64, kFarMetres = 1000;

/// Where things take shadows: a cube in the world around a place. In steps of a fifth of a reach of `metres`, so that
/// it stays while that place moves a little.
[[nodiscard]] Box shadedAround(const Vec3d& place, double metres, double unitsPerMetre);

/// Sides of their maps, in pixels.
inline constexpr int kSunMapPx = 2048, kSpotMapPx = 1024;

/// Of a directional light all of `shaded`, in steps, so that the map's pixels stay where they are as long as its size
/// changes little; of a spot its cone, up to 80 degrees from its axis, from a thousandth of its range or of how far
/// `shaded` reaches.
[[nodiscard]] ScreenCamera shadowCamera(const LightItem& light, const Box& shaded);
/// `sun`'s look at what is near the eye of a screen: in steps, so that it stays while the eye moves a little.
[[nodiscard]] std::optional<ScreenCamera> nearShadowCamera(const ScreenCamera& sun, const ScreenCamera& screen);

}  // namespace tessera
