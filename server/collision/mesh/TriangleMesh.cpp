#include "server/collision/mesh/TriangleMesh.h"

#include <cmath>
#include <string>

namespace tessera {

template <typename Scalar>
Expected<TriangleMesh> TriangleMesh::makeFrom(std::span<const Scalar> positions, std::span<const std::uint32_t> indices,
                                              const TriangleMeshLimits& limits) {
    if (positions.size() % 3 != 0)
        return fail(ErrorCode::kBadInput,
                    std::to_string(positions.size()) + " coordinates are no whole number of vertices");
    if (indices.size() % 3 != 0)
        return fail(ErrorCode::kBadInput, std::to_string(indices.size()) + " indices are no whole number of triangles");
    const std::size_t vertices = positions.size() / 3;
    if (vertices > limits.maxVertices)
        return fail(ErrorCode::kLimit,
                    std::to_string(vertices) + " vertices, at most " + std::to_string(limits.maxVertices));
    if (indices.size() / 3 > limits.maxTriangles)
        return fail(ErrorCode::kLimit,
                    std::to_string(indices.size() / 3) + " triangles, at most " + std::to_string(limits.maxTriangles));
    for (std::size_t i = 0; i < positions.size(); ++i)
        if (!(std::abs(static_cast<double>(positions[i])) <= limits.maxCoordinate))
            return fail(ErrorCode::kBadInput,
                        "vertex " + std::to_string(i / 3) + " has a coordinate that is not finite or too large");
    for (std::size_t i = 0; i < indices.size(); ++i)
        if (indices[i] >= vertices)
            return fail(ErrorCode::kBadInput, "triangle " + std::to_string(i / 3) + " names vertex " +
                                                  std::to_string(indices[i]) + " of " + std::to_string(vertices));

    TriangleMesh mesh;
    mesh.positions_.reserve(vertices);
    for (std::size_t i = 0; i < vertices; ++i)
        mesh.positions_.emplace_back(static_cast<double>(positions[3 * i]), static_cast<double>(positions[3 * i + 1]),
                                     static_cast<double>(positions[3 * i + 2]));
    mesh.indices_.assign(indices.begin(), indices.end());
    for (const std::uint32_t index : indices) mesh.bounds_.extend(mesh.positions_[index]);
    return mesh;
}

Expected<TriangleMesh> TriangleMesh::make(std::span<const float> positions, std::span<const std::uint32_t> indices,
                                          const TriangleMeshLimits& limits) {
    return makeFrom(positions, indices, limits);
}

Expected<TriangleMesh> TriangleMesh::make(std::span<const double> positions, std::span<const std::uint32_t> indices,
                                          const TriangleMeshLimits& limits) {
    return makeFrom(positions, indices, limits);
}

Expected<void> TriangleMesh::move(std::span<const Vec3d> positions) {
    if (positions.size() != positions_.size())
        return fail(ErrorCode::kBadInput,
                    std::to_string(positions.size()) + " positions for " + std::to_string(positions_.size()) + " vertices");
    for (std::size_t i = 0; i < positions.size(); ++i)
        if (!(positions[i].cwiseAbs().maxCoeff<Eigen::PropagateNaN>() <= TriangleMeshLimits{}.maxCoordinate))
            return fail(ErrorCode::kBadInput, "vertex " + std::to_string(i) + " has a coordinate that is not finite or too large");
    positions_.assign(positions.begin(), positions.end());
    bounds_ = {};
    for (const std::uint32_t index : indices_) bounds_.extend(positions_[index]);
    return {};
}

}  // namespace tessera
