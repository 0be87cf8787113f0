/// What does a ray meet of a mesh?
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/base/Error.h"
#include "common/math/Ray.h"
#include "common/math/Types.h"

namespace tessera {

/// Where a ray meets a triangle.
struct TriangleHit {
    double t = 0;  ///< in lengths of the ray's direction
    std::uint32_t face = 0;
    std::array<double, 3> weights{};  ///< barycentric: of the face's corners; they sum up to 1
};

/// A tree over the triangles of a mesh: eight children to a node, up to four triangles to a leaf (about 70 bytes a
/// triangle). Immutable; any number of threads may ask.
///
/// Triangles are met from either side and at their edges and corners: a ray that meets an edge or a corner that
/// triangles share meets one of them at least, so none passes through a closed surface (RayKernels.inl says why). One
/// with a corner that is not finite is not met; whether one without area is, rounding says. t is within a few roundings
/// of a double of where the ray meets the plane, however far away the ray begins; of a ray from farther away than 2^28
/// times the mesh's size within those of where it begins. A ray that is not finite or has no direction meets nothing.
/// The same answers with SSE2 and with AVX2.
class RayTree {
public:
    /// `positions`: float[3] per vertex. `indices`: three per face; empty: consecutive vertices. kBadInput: an index
    /// without a vertex, a number of values that is no multiple of three. kLimit: more than 2^31 - 1 faces.
    [[nodiscard]] static Expected<RayTree> build(std::span<const float> positions,
                                                 std::span<const std::uint32_t> indices);
    ~RayTree();
    RayTree(RayTree&&) noexcept;
    RayTree& operator=(RayTree&&) noexcept;

    static constexpr double kForever = std::numeric_limits<double>::infinity();
    /// The nearest with 0 <= t <= maxT; of equal t the lowest face (of a ray from more than 16 sizes away: one of those
    /// that rounding makes equal).
    [[nodiscard]] std::optional<TriangleHit> nearest(const Ray& ray, double maxT = kForever) const;
    /// Whether there is one: shadows, sights.
    [[nodiscard]] bool any(const Ray& ray, double maxT = kForever) const;
    /// All of them by t, then face; the nearest `most` where there are more.
    [[nodiscard]] std::vector<TriangleHit> all(const Ray& ray, double maxT = kForever,
                                               std::size_t most = std::numeric_limits<std::size_t>::max()) const;

    /// Faces that can be met; 0: nothing can.
    [[nodiscard]] std::size_t faceCount() const;
    [[nodiscard]] std::size_t memoryBytes() const;

private:
    struct Storage;
    explicit RayTree(std::unique_ptr<const Storage> storage);
    std::unique_ptr<const Storage> storage_;
};

}  // namespace tessera
