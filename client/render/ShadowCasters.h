/// What stands in the way of the lights that have shadows. Follows from the scene alone: the same on every tile.
#pragma once

#include <vector>

#include "client/render/DrawList.h"

namespace tessera {

/// A light's own look at the scene, of which its shadows are made.
struct ShadowView {
    ScreenCamera camera;          ///< from the light; eye space in world units; as many pixels as its map has
    std::vector<DrawItem> items;  ///< solid things that it may see, in no particular order; no lines
};

/// One for each light of the list that has `shadows`, in the list's order.
struct ShadowCasters {
    std::vector<ShadowView> views;
};

/// Sides of their maps, in pixels.
inline constexpr int kSunMapPx = 2048, kSpotMapPx = 1024;

/// Of a directional light all of `scene`, in steps, so that the map's pixels stay where they are as long as its size changes
/// little; of a spot its cone, up to 80 degrees from its axis, as far as its range or the scene reaches.
[[nodiscard]] ScreenCamera shadowCamera(const LightItem& light, const Box& scene);

}  // namespace tessera
