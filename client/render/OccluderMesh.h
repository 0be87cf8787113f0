/// A mesh made ready to hide things: vertices welded, every edge knows whether a triangle continues behind it.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace tessera {

/// Immutable. The arrays must have passed checkMesh.
class OccluderMesh {
public:
    /// Meshes with more are never occluders: finding what they hide would cost more than it saves.
    static constexpr std::size_t kMaxTriangles = 200'000;
    static constexpr std::uint32_t kNone = 0xffffffffu;

    struct Triangle {
        std::array<std::uint32_t, 3> vertex;
        /// The triangle behind edge (vertex[i], vertex[i+1]); kNone where there is none, where there are several, or
        /// where it is wound the other way: light may come through there.
        std::array<std::uint32_t, 3> behind;
    };
    using Point = std::array<float, 3>;

    OccluderMesh(std::span<const float> positions, std::span<const std::uint32_t> indices);

    [[nodiscard]] std::span<const Point> points() const { return points_; }
    [[nodiscard]] std::span<const Triangle> triangles() const { return triangles_; }

private:
    std::vector<Point> points_;
    std::vector<Triangle> triangles_;
};

}  // namespace tessera
