/// The convex hull of a point set or of a mesh, exact.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/Error.h"
#include "common/math/Box.h"
#include "server/collision/mesh/TriangleMesh.h"

namespace tessera {

struct ConvexHullLimits {
    std::size_t maxPoints = 64'000'000;
    /// Larger coordinates leave the range in which the predicates are exact.
    double maxCoordinate = 1e50;
};

/// Immutable: query it from any thread. Every decision was exact (Predicates.h), so every input point lies inside the
/// hull or on it, exactly, and the hull is the same on every processor and for every order of equal computations:
/// vertices are the corners of the hull alone (no point inside an edge or a side), in the order in which they came;
/// each side is triangulated in one fixed way.
///
/// Coordinates nearer to 0 than 1e-60 count as 0, since products of them would leave a double's range.
class ConvexHull {
public:
    using Face = std::array<std::uint32_t, 3>;
    static constexpr std::uint32_t kAnyVertex = ~std::uint32_t{0};

    /// kBadInput: no points, or a coordinate that is not finite or too large (says which); kLimit: too many points.
    [[nodiscard]] static Expected<ConvexHull> make(std::span<const Vec3d> points, const ConvexHullLimits& limits = {});
    /// Of the vertices that its triangles use. An empty mesh has no hull.
    [[nodiscard]] static Expected<ConvexHull> make(const TriangleMesh& mesh, const ConvexHullLimits& limits = {});

    /// 3: a body. 2: all in one plane, a polygon. 1: a segment. 0: a point.
    [[nodiscard]] int dimension() const { return dimension_; }
    [[nodiscard]] std::span<const Vec3d> vertices() const { return vertices_; }
    /// Which input point or vertex of the mesh (the first among equal ones), ascending.
    [[nodiscard]] std::span<const std::uint32_t> sources() const { return sources_; }
    /// Triangles with area, counter-clockwise seen from outside, a closed surface; ascending. A polygon has both sides,
    /// a segment and a point have none.
    [[nodiscard]] std::span<const Face> faces() const { return faces_; }
    /// The vertices that share an edge of a face (or the segment) with this one, ascending.
    [[nodiscard]] std::span<const std::uint32_t> neighbours(std::uint32_t vertex) const {
        return std::span(neighbours_)
            .subspan(firstNeighbour_[vertex], firstNeighbour_[vertex + 1] - firstNeighbour_[vertex]);
    }
    [[nodiscard]] const Box& bounds() const { return bounds_; }
    /// The mean of the vertices: inside, to rounding.
    [[nodiscard]] const Vec3d& centre() const { return centre_; }

    /// Inside or on the surface, exactly. Looks at every face.
    [[nodiscard]] bool contains(const Vec3d& p) const;

    /// A vertex farthest along `direction` (finite, of any length; zero takes any). Hulls of few vertices are scanned:
    /// the answer is then farthest to rounding (of the dot product). Others are climbed, along edges, from `start`
    /// (kAnyVertex: none known) or from a vertex kept for directions like this one, whichever is farther; the answer is
    /// then the farthest exactly. `looks` counts the vertices that were looked at.
    [[nodiscard]] std::uint32_t support(const Vec3d& direction, std::uint32_t start, std::uint64_t& looks) const;
    static constexpr std::size_t kScannedVertices = 32;

    [[nodiscard]] std::size_t memoryBytes() const;

private:
    ConvexHull() = default;
    void finish(std::vector<Vec3d> vertices, std::vector<std::uint32_t> sources, std::vector<Face> faces,
                int dimension);
    void connect();
    void keepStarts();
    [[nodiscard]] std::size_t cellOf(const Vec3d& direction) const;
    [[nodiscard]] std::uint32_t climb(const Vec3d& direction, std::uint32_t from, std::uint64_t& looks) const;
    [[nodiscard]] std::uint32_t scan(const Vec3d& direction) const;

    int dimension_ = 0;
    std::vector<Vec3d> vertices_;
    std::vector<std::uint32_t> sources_;
    std::vector<Face> faces_;
    std::vector<std::uint32_t> firstNeighbour_, neighbours_;
    Box bounds_;
    Vec3d centre_ = Vec3d::Zero();
    std::vector<double> columns_;        ///< x, y and z of few vertices, each column filled up to a multiple of four
    std::uint32_t cells_ = 0;            ///< per edge of a cube's side; 0 for hulls that are scanned
    std::vector<std::uint32_t> starts_;  ///< per cell of the six sides: a vertex farthest along its middle
};

}  // namespace tessera
