/// The triangles of one body, checked once so that queries need not doubt them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <iterator>
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

/// The vertices of a mesh, exact doubles; a view.
class MeshPositions {
public:
    MeshPositions(const float* floats, const double* doubles, std::size_t size)
        : floats_(floats), doubles_(doubles), size_(size) {}

    [[nodiscard]] std::size_t size() const { return size_; }
    [[nodiscard]] bool empty() const { return size_ == 0; }
    [[nodiscard]] Vec3d operator[](std::size_t i) const { return at(floats_, doubles_, i); }
    /// xyz per vertex, as they are kept: one of the two is null. Both are for an empty mesh.
    [[nodiscard]] const float* floats() const { return floats_; }
    [[nodiscard]] const double* doubles() const { return doubles_; }

    class Iterator {
    public:
        using iterator_category = std::input_iterator_tag;
        using value_type = Vec3d;
        using difference_type = std::ptrdiff_t;
        using pointer = const Vec3d*;
        using reference = Vec3d;

        Iterator(const float* floats, const double* doubles, std::size_t place)
            : floats_(floats), doubles_(doubles), place_(place) {}
        Vec3d operator*() const { return at(floats_, doubles_, place_); }
        Iterator& operator++() {
            ++place_;
            return *this;
        }
        Iterator operator++(int) {
            Iterator before = *this;
            ++place_;
            return before;
        }
        bool operator==(const Iterator& other) const { return place_ == other.place_; }

    private:
        const float* floats_;
        const double* doubles_;
        std::size_t place_;
    };
    [[nodiscard]] Iterator begin() const { return {floats_, doubles_, 0}; }
    [[nodiscard]] Iterator end() const { return {floats_, doubles_, size_}; }

private:
    static Vec3d at(const float* floats, const double* doubles, std::size_t i) {
        if (floats != nullptr) return Eigen::Map<const Vec3f>(floats + 3 * i).cast<double>();
        return Eigen::Map<const Vec3d>(doubles + 3 * i);
    }

    const float* floats_;
    const double* doubles_;
    std::size_t size_;
};

/// Immutable but for `move`. Face = the triangle's index in the order given. Duplicate and degenerate triangles, open
/// and non-manifold meshes are all right; an empty mesh meets nothing. Coordinates that are floats, the usual case, are
/// kept as floats.
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

    /// Takes new positions, one per vertex; the triangles stay. kBadInput, and nothing is changed, for another number
    /// of vertices or for coordinates that make() would refuse.
    Expected<void> move(std::span<const Vec3d> positions);
    /// The same for the vertices from `first` on; costs what they are, and a pass over all where the box may shrink.
    Expected<void> move(std::size_t first, std::span<const Vec3d> positions);

    /// How often vertices have moved: who keeps what follows from their places compares it.
    [[nodiscard]] std::uint64_t moves() const { return moves_; }

    [[nodiscard]] std::size_t faceCount() const { return indices_.size() / 3; }
    [[nodiscard]] std::size_t vertexCount() const { return floats_.empty() ? doubles_.size() : floats_.size(); }
    [[nodiscard]] MeshPositions positions() const {
        return {floats_.empty() ? nullptr : floats_.data()->data(),
                doubles_.empty() ? nullptr : doubles_.data()->data(), vertexCount()};
    }
    [[nodiscard]] std::span<const std::uint32_t> indices() const { return indices_; }
    [[nodiscard]] std::size_t memoryBytes() const {
        return floats_.size() * sizeof(Vec3f) + doubles_.size() * sizeof(Vec3d) +
               indices_.size() * sizeof(std::uint32_t) + used_.size() / 8;
    }
    [[nodiscard]] std::uint32_t vertexOf(std::uint32_t face, unsigned i) const { return indices_[3 * face + i]; }
    [[nodiscard]] Vec3d corner(std::uint32_t face, unsigned i) const {
        const std::uint32_t vertex = indices_[3 * std::size_t{face} + i];
        if (!floats_.empty()) return floats_[vertex].cast<double>();
        return doubles_[vertex];
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

    /// One of them is empty: doubles where some coordinate is no float.
    std::vector<Vec3f> floats_;
    std::vector<Vec3d> doubles_;
    std::vector<std::uint32_t> indices_;
    std::vector<bool> used_;  ///< per vertex, by some triangle; empty where all are
    Box bounds_;
    std::uint64_t moves_ = 0;

    /// Takes coordinates that are good.
    template <typename Scalar>
    void take(const Scalar* coordinates, std::size_t vertices);
    void findBounds();
};

/// The same triangle seen in another frame.
[[nodiscard]] inline Triangle transformed(const Affine3d& m, const Triangle& t) {
    return {m * t[0], m * t[1], m * t[2]};
}

}  // namespace tessera
