#include "server/collision/mesh/TriangleMesh.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <type_traits>

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
    mesh.take(positions.data(), vertices);
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

namespace {

constexpr std::size_t kLanes = 8;

/// Whether all of these numbers are 0; not where one is no number. Lane by lane, without a branch within: compilers
/// make vectors of it.
template <typename Of>
bool allZero(const double* numbers, std::size_t count, const Of& of) {
    double sum[kLanes] = {};
    std::size_t i = 0;
    for (; i + kLanes <= count; i += kLanes)
        for (std::size_t k = 0; k < kLanes; ++k) sum[k] += of(numbers[i + k]);
    for (; i < count; ++i) sum[0] += of(numbers[i]);
    return std::ranges::all_of(sum, [](double x) { return x == 0; });
}

/// Of numbers that are finite, and no larger than TriangleMeshLimits allow: those beyond float become infinite.
bool allFloats(const double* numbers, std::size_t count) {
    return allZero(numbers, count, [](double x) { return std::abs(static_cast<double>(static_cast<float>(x)) - x); });
}

Expected<void> checkCoordinates(std::span<const Vec3d> positions, std::size_t first) {
    // One pass that carries on, then one that looks for the place: bad input is rare.
    const double most = TriangleMeshLimits{}.maxCoordinate;
    const double* const coordinates = positions.empty() ? nullptr : positions.data()->data();
    const bool good =
        allZero(coordinates, 3 * positions.size(), [most](double x) { return std::abs(x) <= most ? 0.0 : 1.0; });
    for (std::size_t i = 0; !good && i < 3 * positions.size(); ++i)
        if (!(std::abs(coordinates[i]) <= most))
            return fail(ErrorCode::kBadInput, "vertex " + std::to_string(first + i / 3) +
                                                  " has a coordinate that is not finite or too large");
    return {};
}

}  // namespace

Expected<void> TriangleMesh::move(std::span<const Vec3d> positions) {
    if (positions.size() != vertexCount())
        return fail(ErrorCode::kBadInput,
                    std::to_string(positions.size()) + " positions for " + std::to_string(vertexCount()) + " vertices");
    if (Expected<void> good = checkCoordinates(positions, 0); !good) return good;
    ++moves_;
    take(positions.empty() ? nullptr : positions.data()->data(), positions.size());
    findBounds();
    return {};
}

namespace {

/// The box of all vertices. Two at once, as one run of numbers: this is half of what following a deformation costs
/// otherwise.
template <typename Scalar>
Box boxOfAll(const std::vector<Eigen::Matrix<Scalar, 3, 1>>& vertices) {
    constexpr std::size_t kTwo = 6;
    const Scalar* const numbers = vertices.data()->data();
    const std::size_t count = 3 * vertices.size();
    Scalar low[kTwo], high[kTwo];
    for (std::size_t k = 0; k < kTwo; ++k) low[k] = high[k] = numbers[k % 3];
    for (std::size_t i = 0; i + kTwo <= count; i += kTwo)
        for (std::size_t k = 0; k < kTwo; ++k) {
            const Scalar x = numbers[i + k];
            low[k] = x < low[k] ? x : low[k];
            high[k] = x > high[k] ? x : high[k];
        }
    Box box;
    for (const Scalar* const p :
         std::initializer_list<const Scalar*>{numbers + count - 3, low, low + 3, high, high + 3})
        box.extend(Eigen::Map<const Eigen::Matrix<Scalar, 3, 1>>(p).template cast<double>());
    return box;
}

}  // namespace

template <typename Scalar>
void TriangleMesh::take(const Scalar* coordinates, std::size_t vertices) {
    bool asFloats = true;
    if constexpr (!std::is_same_v<Scalar, float>) asFloats = allFloats(coordinates, 3 * vertices);
    if (asFloats) {
        floats_.resize(vertices);
        if (vertices != 0)
            std::transform(coordinates, coordinates + 3 * vertices, floats_.data()->data(),
                           [](Scalar x) { return static_cast<float>(x); });
        doubles_ = {};
        return;
    }
    doubles_.resize(vertices);
    if (vertices != 0)
        std::transform(coordinates, coordinates + 3 * vertices, doubles_.data()->data(),
                       [](Scalar x) { return static_cast<double>(x); });
    floats_ = {};
}

Expected<void> TriangleMesh::move(std::size_t first, std::span<const Vec3d> positions) {
    if (first > vertexCount() || positions.size() > vertexCount() - first)
        return fail(ErrorCode::kBadInput, std::to_string(positions.size()) + " positions from vertex " +
                                              std::to_string(first) + " on for " + std::to_string(vertexCount()) +
                                              " vertices");
    if (Expected<void> good = checkCoordinates(positions, first); !good) return good;
    if (positions.empty()) return {};
    ++moves_;
    const double* const coordinates = positions.data()->data();
    if (!floats_.empty() && !allFloats(coordinates, 3 * positions.size())) {
        doubles_.reserve(floats_.size());
        for (const Vec3f& p : floats_) doubles_.push_back(p.cast<double>());
        floats_ = {};
    }
    bool onBox = false;
    Box box = bounds_;
    for (std::size_t i = 0; i < positions.size(); ++i) {
        const std::size_t vertex = first + i;
        if (used_.empty() || used_[vertex]) {
            const Vec3d before = this->positions()[vertex];
            onBox = onBox || (before.array() == bounds_.lower.array()).any() ||
                    (before.array() == bounds_.upper.array()).any();
            box.extend(positions[i]);
        }
        if (floats_.empty())
            doubles_[vertex] = positions[i];
        else
            floats_[vertex] = positions[i].cast<float>();
    }
    bounds_ = box;
    // Nobody else may hold the box open.
    if (onBox) findBounds();
    return {};
}

void TriangleMesh::findBounds() {
    bounds_ = {};
    if (indices_.empty()) return;
    if (used_.empty()) {
        bounds_ = floats_.empty() ? boxOfAll(doubles_) : boxOfAll(floats_);
        return;
    }
    Box box;
    const MeshPositions all = positions();
    for (std::size_t i = 0; i < all.size(); ++i)
        if (used_[i]) box.extend(all[i]);
    bounds_ = box;
}

}  // namespace tessera
