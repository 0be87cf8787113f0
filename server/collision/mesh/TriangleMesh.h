/// The triangles of one body, checked once so that queries need not doubt them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/base/Error.h"
#include "common/math/Box.h"
#include "server/collision/mesh/TriangleTriangle.h"

namespace tessera {

struct TriangleMeshLimits {
    std::size_t maxVertices = 64'000'000;
    std::size_t maxTriangles = 64'000'000;
    /// Larger coordinates leave the range in which the predicates are exact.
    double maxCoordinate = 1e50;
};

/// Immutable but for `move`. Face = the triangle's index in the order given. Duplicate and degenerate triangles, open and non-manifold
/// meshes are all right; an empty mesh meets nothing.
class TriangleMesh {
public:
    TriangleMesh() = default;
    /// xyz per vertex, three indices per triangle. kBadInput says which number is wrong: a count that is no multiple of
    /// three, an index out of range, a coordinate that is not finite or too large.
    [[nodiscard]] static Expected<TriangleMesh> make(std::span<const float> positions,
                                                     std::span<const std::uint32_t> indices,
                                                     const TriangleMeshLimits& limits = {});
    [[nodiscard]] static Expected<TriangleMesh> make(std::span<const double> positions,
                                                     std::span<const std::uint32_t> indices,
                                                     const TriangleMeshLimits& limits = {});

    /// Takes new positions, one per vertex; the triangles stay. kBadInput, and nothing is changed, for another number of
    /// vertices or for coordinates that make() would refuse.
    Expected<void> move(std::span<const Vec3d> positions);

    [[nodiscard]] std::size_t faceCount() const { return indices_.size() / 3; }
    [[nodiscard]] std::size_t vertexCount() const { return positions_.size(); }
    [[nodiscard]] std::span<const Vec3d> positions() const { return positions_; }
    [[nodiscard]] std::span<const std::uint32_t> indices() const { return indices_; }
    [[nodiscard]] std::size_t memoryBytes() const {
        return positions_.size() * sizeof(Vec3d) + indices_.size() * sizeof(std::uint32_t) + used_.size() / 8;
    }
    [[nodiscard]] std::uint32_t vertexOf(std::uint32_t face, unsigned i) const { return indices_[3 * face + i]; }
    [[nodiscard]] const Vec3d& corner(std::uint32_t face, unsigned i) const {
        return positions_[indices_[3 * face + i]];
    }
    [[nodiscard]] Triangle triangle(std::uint32_t face) const {
        return {corner(face, 0), corner(face, 1), corner(face, 2)};
    }
    /// The box around the triangles (vertices that no triangle uses do not count).
    [[nodiscard]] const Box& bounds() const { return bounds_; }

private:
    template <typename Scalar>
    static Expected<TriangleMesh> makeFrom(std::span<const Scalar> positions, std::span<const std::uint32_t> indices,
                                           const TriangleMeshLimits& limits);

    std::vector<Vec3d> positions_;
    std::vector<std::uint32_t> indices_;
    std::vector<bool> used_;  ///< per vertex, by some triangle; empty where all are
    Box bounds_;

    void findBounds();
};

/// The same triangle seen in another frame.
[[nodiscard]] inline Triangle transformed(const Affine3d& m, const Triangle& t) {
    return {m * t[0], m * t[1], m * t[2]};
}

}  // namespace tessera
