/// How far from an origin things may reach.
#pragma once

namespace tessera {

/// The greatest coordinate of what is drawn, in world units, each by itself. Squares of it, and sums of them, are
/// floats with room for any view's scale; of what is farther a renderer's numbers overflow. Arrays may hold larger
/// numbers that transforms make small.
inline constexpr double kUtmostCoordinate = 1e18;

}  // namespace tessera
