#include "server/collision/query/NearestFace.h"

#include <algorithm>
#include <cmath>
#include <queue>
#include <utility>
#include <vector>

#include "common/math/Decompositions.h"
#include "server/collision/tree/TreeStorage.h"

namespace tessera {
namespace {

using kernel::ChildRef;
using kernel::kLeafBit;
using kernel::kLeafFaces;
using kernel::kWidth;
using kernel::Slot;

/// Of a triangle that may be thin, or have no area, and be far away. Each candidate is a point of the triangle: where
/// rounding has left little of the weights of the foot of the plumb line, an edge is as near.
Vec3d nearestToOrigin(const Triangle& t) {
    Vec3d nearest = t[0];
    const auto offer = [&](const Vec3d& point) {
        if (point.squaredNorm() < nearest.squaredNorm()) nearest = point;
    };
    Vec3d weights;
    const Vec3d normal = (t[1] - t[0]).cross(t[2] - t[0]);
    for (std::size_t i = 0; i < 3; ++i) {
        const Vec3d &from = t[(i + 1) % 3], &to = t[(i + 2) % 3], along = to - from;
        const double square = along.squaredNorm();
        offer(from + (square > 0 ? std::clamp(-along.dot(from) / square, 0.0, 1.0) : 0.0) * along);
        weights[static_cast<int>(i)] = normal.dot(from.cross(to));
    }
    if ((weights.array() > 0).all()) {
        weights /= weights.sum();
        offer(weights[0] * t[0] + weights[1] * t[1] + weights[2] * t[2]);
    }
    return nearest;
}

/// Best first: whatever is looked into may hold something nearer than all that was found.
///
/// Two bounds hold for a volume, and the larger counts. In the tree's own coordinates it is as tight as the volume, but
/// a length there is no less than `least_` of one outside. The box around the mapped volume is right however the map
/// stretches or flattens.
class NearestWalk {
public:
    NearestWalk(const TreeStorage& tree, const Affine3d& map, const Vec3d& place, double within, QueryWork& work)
        : tree_(tree),
          origin_T_mesh_(Eigen::Translation3d(-place) * map),
          shape_(shapeOf(tree.options.volume)),
          rows_(rowsOf(tree.options.volume)),
          limit_(within),
          work_(work) {
        origin_T_own_ = origin_T_mesh_ * Eigen::Translation3d(tree.centre) * Eigen::Scaling(1 / tree.unit);
        const SingularStretch stretch = singularStretchOf(origin_T_own_.linear());
        most_ = stretch.most;
        constexpr double kFlat = 1e-10;
        if (!(stretch.least > kFlat * most_)) return;
        place_ = origin_T_own_.inverse() * Vec3d::Zero();
        if (place_.allFinite()) least_ = stretch.least;
    }

    std::optional<NearestFace> nearest() {
        using Open = std::pair<double, Slot>;
        std::priority_queue<Open, std::vector<Open>, std::greater<>> open;
        for (open.emplace(0, 0); !open.empty() && open.top().first <= limit_;) {
            if (work_.exhausted()) return std::nullopt;
            const ChildRef ref = tree_.children[open.top().second];
            open.pop();
            if ((ref & kLeafBit) != 0) {
                meetLeaf(ref);
                continue;
            }
            for (Slot child = ref * kWidth; child < (ref + 1) * kWidth; ++child) {
                if (tree_.children[child] == kernel::kNoChild) continue;
                ++work_.boxTests;
                if (const double from = atLeast(child); from <= limit_) open.emplace(from, child);
            }
        }
        return best_;
    }

private:
    void meetLeaf(ChildRef leaf) {
        const std::size_t first = ((leaf & ~kLeafBit) >> 2) * kLeafFaces;
        for (std::size_t i = first; i <= first + (leaf & 3); ++i) {
            ++work_.triangleTests;
            const std::uint32_t face = tree_.leafFaces[i];
            const Triangle triangle = transformed(origin_T_mesh_, tree_.mesh->triangle(face));
            const Vec3d point = nearestToOrigin(triangle);
            const double distance = point.norm();
            if (!(distance <= limit_) || (best_ && distance == best_->distance && face > best_->face)) continue;
            best_ = NearestFace{face, point, distance};
            limit_ = distance;
        }
    }

    /// No point of what is in the volume is nearer.
    [[nodiscard]] double atLeast(Slot slot) const {
        const float* const volume = tree_.volumes[std::size_t{slot / kWidth} * rows_].lane + slot % kWidth;
        const auto row = [&](std::size_t r) { return static_cast<double>(volume[r * kWidth]); };
        Vec3d centre(row(0), row(1), row(2)), half = Vec3d::Zero();
        Mat3d axes = Mat3d::Identity();
        double radius = 0;
        if (shape_ == kernel::Shape::kSphere) {
            radius = row(3);
        } else if (shape_ == kernel::Shape::kObb) {
            for (int i = 0; i < 3; ++i) {
                const auto r = static_cast<std::size_t>(i);
                axes.col(i) = Vec3d(row(3 + 3 * r), row(4 + 3 * r), row(5 + 3 * r));
                half[i] = row(12 + r);
            }
        } else {
            // The slabs of the axes come first in every set of directions.
            for (int i = 0; i < 3; ++i) {
                const double upper = row(static_cast<std::size_t>(i)),
                             lower = -row(static_cast<std::size_t>(i) + rows_ / 2);
                centre[i] = 0.5 * (upper + lower);
                half[i] = 0.5 * (upper - lower);
            }
        }
        return std::max(boundWithin(centre, axes, half, radius), boundOutside(centre, axes, half, radius));
    }

    [[nodiscard]] double boundWithin(const Vec3d& centre, const Mat3d& axes, const Vec3d& half, double radius) const {
        if (least_ == 0) return 0;
        const Vec3d away = place_ - centre;
        const Vec3d beyond = ((axes.transpose() * away).cwiseAbs() - half).cwiseMax(0.0);
        const double slack = kOwnSlack + kAxes * away.norm() + kRounding * place_.norm();
        return least_ * (1 - kRounding) * (beyond.norm() - radius - slack);
    }

    [[nodiscard]] double boundOutside(const Vec3d& centre, const Mat3d& axes, const Vec3d& half, double radius) const {
        const Vec3d middle = origin_T_own_ * centre;
        const Vec3d reach = (origin_T_own_.linear() * axes).cwiseAbs() * half;
        const Vec3d beyond = (middle.cwiseAbs() - reach).cwiseMax(0.0);
        const double size = middle.norm() + reach.norm() + origin_T_own_.translation().norm();
        return beyond.norm() - most_ * (radius + kOwnSlack) - kRounding * size;
    }

    /// Of the tree's own lengths: what rounding to float has done to corners and volumes.
    static constexpr double kOwnSlack = 4e-6;
    /// Axes of oriented boxes are floats: by so much the length of a vector is wrong in them.
    static constexpr double kAxes = 1e-6;
    static constexpr double kRounding = 1e-12;

    const TreeStorage& tree_;
    const Affine3d origin_T_mesh_;  ///< the place is the origin
    Affine3d origin_T_own_;
    Vec3d place_ = Vec3d::Zero();  ///< in own coordinates
    double least_ = 0, most_ = 0;  ///< of an own length outside; 0: nothing is known
    const kernel::Shape shape_;
    const std::size_t rows_;
    double limit_;
    QueryWork& work_;
    std::optional<NearestFace> best_;
};

}  // namespace

std::optional<NearestFace> nearestFace(const TriangleTree& tree, const Affine3d& map, const Vec3d& place,
                                       QueryWork& work, double within) {
    if (tree.storage().empty() || !place.allFinite() || !map.matrix().allFinite()) return std::nullopt;
    std::optional<NearestFace> found = NearestWalk(tree.storage(), map, place, within, work).nearest();
    if (found) found->point += place;
    return found;
}

}  // namespace tessera
