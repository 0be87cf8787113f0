#include "server/collision/query/RayQuery.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "server/collision/query/RayTriangle.h"
#include "server/collision/tree/TreeStorage.h"

namespace tessera {
namespace {

using kernel::ChildRef;
using kernel::kLeafBit;
using kernel::kLeafFaces;
using kernel::kWidth;
using kernel::Slot;

constexpr double kMissed = std::numeric_limits<double>::infinity();

/// Walks in the tree's own coordinates, where t is the same; its volumes are grown by all that rounding can do.
class RayWalk {
public:
    RayWalk(const TreeStorage& tree, const Ray& ray, double maxT, QueryWork& work)
        : tree_(tree),
          ray_(ray),
          origin_((ray.origin - tree.centre) * tree.unit),
          direction_(ray.direction * tree.unit),
          shape_(shapeOf(tree.options.volume)),
          rows_(rowsOf(tree.options.volume)),
          // A float's rounding of corners, volumes and axes (a ray begins at most 28 lengths away), a double's of a
          // ray, and the hair that whereRayMeets adds.
          slack_(4e-6 + 1e-13 * origin_.norm()),
          limit_(maxT),
          work_(work) {}

    std::optional<RayHit> nearest() {
        std::vector<std::pair<double, Slot>> open{{0, 0}};
        std::vector<std::pair<double, Slot>> children;
        while (!open.empty()) {
            if (work_.exhausted()) return std::nullopt;
            const auto [from, slot] = open.back();
            open.pop_back();
            if (from > limit_) continue;
            const ChildRef ref = tree_.children[slot];
            if ((ref & kLeafBit) != 0) {
                meetLeaf(ref);
                continue;
            }
            children.clear();
            work_.boxTests += kWidth;
            for (Slot child = ref * kWidth; child < (ref + 1) * kWidth; ++child)
                if (tree_.children[child] != kernel::kNoChild)
                    if (const double t = entry(child); t < kMissed && t <= limit_) children.emplace_back(t, child);
            // The nearest is taken from the stack first.
            std::sort(children.begin(), children.end(), std::greater<>());
            open.insert(open.end(), children.begin(), children.end());
        }
        return best_;
    }

private:
    void meetLeaf(ChildRef leaf) {
        const std::size_t first = ((leaf & ~kLeafBit) >> 2) * kLeafFaces;
        for (std::size_t i = first; i <= first + (leaf & 3); ++i) {
            const std::uint32_t face = tree_.leafFaces[i];
            ++work_.triangleTests;
            const std::optional<double> t = whereRayMeets(tree_.mesh->triangle(face), ray_);
            if (!t || *t > limit_ || (best_ && *t == best_->t && face > best_->face)) continue;
            best_ = RayHit{face, *t};
            limit_ = *t;
        }
    }

    /// Where the ray enters a volume at the earliest, or kMissed.
    [[nodiscard]] double entry(Slot slot) const {
        const float* const volume = tree_.volumes[std::size_t{slot / kWidth} * rows_].lane + slot % kWidth;
        const auto row = [&](std::size_t r) { return static_cast<double>(volume[r * kWidth]); };
        double near = 0, far = limit_;
        const auto slab = [&](double along, double at, double half) {
            const double h = half + slack_;
            if (along == 0) {
                if (std::abs(at) > h) far = -1;
                return;
            }
            double t0 = (-h - at) / along, t1 = (h - at) / along;
            if (t0 > t1) std::swap(t0, t1);
            near = std::max(near, t0 - 1e-14 * std::abs(t0));
            far = std::min(far, t1 + 1e-14 * std::abs(t1));
        };
        if (shape_ == kernel::Shape::kSphere || shape_ == kernel::Shape::kObb) {
            const Vec3d away = origin_ - Vec3d(row(0), row(1), row(2));
            if (shape_ == kernel::Shape::kObb) {
                for (std::size_t i = 0; i < 3; ++i) {
                    const Vec3d axis(row(3 + 3 * i), row(4 + 3 * i), row(5 + 3 * i));
                    slab(axis.dot(direction_), axis.dot(away), row(12 + i));
                }
            } else {
                // The box around the sphere: balls are for short queries, and a ray is none.
                for (int k = 0; k < 3; ++k) slab(direction_[k], away[k], row(3));
            }
        } else {
            // The slabs of the axes come first in every set of directions.
            for (std::size_t k = 0; k < 3; ++k) {
                const double upper = row(k), lower = -row(k + rows_ / 2);
                const int axis = static_cast<int>(k);
                slab(direction_[axis], origin_[axis] - 0.5 * (upper + lower), 0.5 * (upper - lower));
            }
        }
        return near <= far ? near : kMissed;
    }

    const TreeStorage& tree_;
    const Ray& ray_;
    Vec3d origin_, direction_;
    kernel::Shape shape_;
    std::size_t rows_;
    double slack_, limit_;
    QueryWork& work_;
    std::optional<RayHit> best_;
};

}  // namespace

std::optional<RayHit> castRay(const TriangleTree& tree, const Ray& ray, double maxT, QueryWork& work) {
    if (tree.storage().empty() || !(maxT >= 0) || !ray.origin.allFinite() || !ray.direction.allFinite() ||
        ray.direction.isZero(0))
        return std::nullopt;
    const TreeStorage& storage = tree.storage();
    const std::optional<NearRay> near = begunNear(ray, storage.centre, 1 / storage.unit);
    if (!near) return std::nullopt;
    std::optional<RayHit> hit = RayWalk(storage, near->ray, limitOf(*near, maxT), work).nearest();
    if (hit) hit->t += near->before;
    return hit && hit->t <= maxT ? hit : std::nullopt;
}

}  // namespace tessera
