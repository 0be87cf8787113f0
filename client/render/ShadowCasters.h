/// What stands in the way of the lights that have shadows. Follows from the scene alone: the same on every tile.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "client/render/DrawList.h"

namespace tessera {

/// A light's own look at the scene, of which its shadows are made.
struct ShadowView {
    ScreenCamera camera;          ///< from the light; eye space in world units; as many pixels as its map has
    std::vector<DrawItem> items;  ///< solid things that it may see, in no particular order; no lines
};

struct ShadowCasters {
    /// One for each light of the list that has `shadows`, in the list's order. The same one as before, as long as it is the
    /// same view of the same scene.
    std::vector<std::shared_ptr<const ShadowView>> views;
    /// A second, finer one of the directional light, of what lies within kNearMetres of the screen's eye; null: the first one
    /// is no coarser.
    std::shared_ptr<const ShadowView> near;
    std::size_t nearOf = 0;  ///< among `views`
};
inline constexpr double kNearMetres = 7;

/// Sides of their maps, in pixels.
inline constexpr int kSunMapPx = 2048, kSpotMapPx = 1024;

/// Of a directional light all of `scene`, in steps, so that the map's pixels stay where they are as long as its size changes
/// little; of a spot its cone, up to 80 degrees from its axis, as far as its range or the scene reaches.
[[nodiscard]] ScreenCamera shadowCamera(const LightItem& light, const Box& scene);
/// `sun`'s look at what is near the eye of a screen: in steps, so that it stays while the eye moves a little.
[[nodiscard]] std::optional<ScreenCamera> nearShadowCamera(const ScreenCamera& sun, const ScreenCamera& screen);

}  // namespace tessera
