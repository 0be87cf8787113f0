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
    /// Meshes with more are never occluders. As a whole: finding what they hide would cost more than it saves. In
    /// parts: they would keep a frame waiting, 0.1 µs for each triangle, where they are made ready.
    [[nodiscard]] static constexpr std::size_t mostTriangles(bool inParts) { return inParts ? 1'000'000 : 200'000; }
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

    /// Triangles [first, end) of `triangles`.
    struct Run {
        std::uint32_t first = 0, end = 0;
    };
    [[nodiscard]] Run all() const { return {0, static_cast<std::uint32_t>(triangles_.size())}; }
    /// What is here of one of MeshCluster's runs: those without corners of their own are not.
    [[nodiscard]] Run cluster(std::size_t index) const { return {clusterStarts_[index], clusterStarts_[index + 1]}; }

private:
    void findNeighbours();

    std::vector<Point> points_;
    std::vector<Triangle> triangles_;
    std::vector<std::uint32_t> clusterStarts_;  ///< and the end of the last
};

}  // namespace tessera
