/// How far from an origin things may reach.
#pragma once

namespace tessera {

/// The greatest coordinate, each by itself: of vertices in their arrays, and of where they come to stand, in world units. Squares of it, and sums of them,
/// are floats with room for any view's scale; of what is farther a renderer's numbers overflow. It is refused where it can be (checkMesh), and named
/// where it comes about by transforms (RenderScene::undrawn).
inline constexpr double kUtmostCoordinate = 1e18;

}  // namespace tessera
