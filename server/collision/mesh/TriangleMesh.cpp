#include "server/collision/mesh/TriangleMesh.h"

#include <algorithm>
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
    std::vector<bool> used(vertices);
    for (const std::uint32_t index : indices) used[index] = true;
    if (std::find(used.begin(), used.end(), false) != used.end()) mesh.used_ = std::move(used);
    mesh.findBounds();
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
    // One pass that carries on, then one that looks for the place: bad input is rare.
    const double most = TriangleMeshLimits{}.maxCoordinate;
    const double* const coordinates = positions.empty() ? nullptr : positions.data()->data();
    bool good = true;
    for (std::size_t i = 0; i < 3 * positions.size(); ++i) good &= std::abs(coordinates[i]) <= most;
    for (std::size_t i = 0; !good && i < 3 * positions.size(); ++i)
        if (!(std::abs(coordinates[i]) <= most))
            return fail(ErrorCode::kBadInput,
                        "vertex " + std::to_string(i / 3) + " has a coordinate that is not finite or too large");
    positions_.assign(positions.begin(), positions.end());
    findBounds();
    return {};
}

void TriangleMesh::findBounds() {
    bounds_ = {};
    if (indices_.empty()) return;
    if (!used_.empty()) {
        Box box;
        for (std::size_t i = 0; i < positions_.size(); ++i)
            if (used_[i]) box.extend(positions_[i]);
        bounds_ = box;
        return;
    }
    // Two vertices at once, as one run of numbers: this is half of what following a deformation costs otherwise.
    constexpr std::size_t kTwo = 6;
    const double* const numbers = positions_.data()->data();
    const std::size_t count = 3 * positions_.size();
    double low[kTwo], high[kTwo];
    for (std::size_t k = 0; k < kTwo; ++k) low[k] = high[k] = numbers[k % 3];
    for (std::size_t i = 0; i + kTwo <= count; i += kTwo)
        for (std::size_t k = 0; k < kTwo; ++k) {
            const double x = numbers[i + k];
            low[k] = x < low[k] ? x : low[k];
            high[k] = x > high[k] ? x : high[k];
        }
    bounds_.extend(positions_.back());
    bounds_.extend(Vec3d(low));
    bounds_.extend(Vec3d(low + 3));
    bounds_.extend(Vec3d(high));
    bounds_.extend(Vec3d(high + 3));
}

}  // namespace tessera
