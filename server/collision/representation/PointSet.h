/// Solid balls of one radius: particles, point clouds, spray.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/Error.h"
#include "common/math/Box.h"

namespace tessera {

struct PointSetLimits {
    std::size_t maxPoints = 64'000'000;
    /// As of meshes.
    double maxCoordinate = 1e50;
};

/// Immutable: query it from any thread. A point's number, in the order given, is its face in answers. Above the points
/// stands a hierarchy of boxes without pointers: points are ordered by halving the longest side, so that each 4 · 16^k
/// of them are one box.
class PointSet {
public:
    /// No points are all right, they meet nothing; so are equal ones. kBadInput: a coordinate that is not finite or too
    /// large (says which), a radius that is negative or likewise. kLimit: too many points.
    [[nodiscard]] static Expected<PointSet> make(std::span<const Vec3d> points, double radius,
                                                 const PointSetLimits& limits = {});

    [[nodiscard]] std::size_t size() const { return floats_.empty() ? doubles_.size() : floats_.size(); }
    [[nodiscard]] double radius() const { return radius_; }
    [[nodiscard]] Vec3d point(std::uint32_t number) const {
        if (!floats_.empty()) return floats_[number].cast<double>();
        return doubles_[number];
    }
    /// Around the balls.
    [[nodiscard]] const Box& bounds() const { return bounds_; }
    /// Around the points.
    [[nodiscard]] const Box& centres() const { return centres_; }
    /// All that it holds: 17 bytes per point, 29 where some coordinate is no float.
    [[nodiscard]] std::size_t memoryBytes() const;

    // The hierarchy, for the queries of this library.

    static constexpr std::uint32_t kFanOut = 16, kLeafPoints = 4;
    /// Nodes are numbered from the whole, 0, down level by level; those of the last level have leaves below them, which
    /// come after all nodes.
    [[nodiscard]] std::uint32_t firstLeaf() const { return static_cast<std::uint32_t>(boxes_.size()); }
    /// Around the points below a node.
    [[nodiscard]] const Box& box(std::uint32_t node) const { return boxes_[node]; }
    /// Nodes or leaves: from the first to before the end.
    struct Children {
        std::uint32_t first, end;
    };
    [[nodiscard]] Children children(std::uint32_t node) const;
    /// The numbers of a leaf's points.
    [[nodiscard]] std::span<const std::uint32_t> pointsOf(std::uint32_t leaf) const;

private:
    PointSet() = default;
    void arrange(std::size_t first, std::size_t end, std::size_t size);
    void fitBoxes();

    double radius_ = 0;
    /// One of them is empty: doubles where some coordinate is no float.
    std::vector<Vec3f> floats_;
    std::vector<Vec3d> doubles_;
    std::vector<std::uint32_t> order_;       ///< the points, leaf by leaf
    std::vector<std::uint32_t> levelStart_;  ///< of each level its first node; and the number of all
    std::vector<Box> boxes_;
    Box centres_, bounds_;
};

}  // namespace tessera
