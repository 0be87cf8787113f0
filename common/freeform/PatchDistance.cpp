#include "common/freeform/PatchDistance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <queue>
#include <utility>
#include <vector>

namespace tessera {
namespace {

double distanceToBox(const Box& box, const Vec3d& p) {
    return (box.lower - p).cwiseMax(p - box.upper).cwiseMax(0).norm();
}

/// The least of the control points along a direction of length 1, from a place.
double leastAlong(const BezierPatch& patch, const Vec3d& place, const Vec3d& direction) {
    double least = std::numeric_limits<double>::infinity();
    for (const Vec4d& p : patch.points) least = std::min(least, (p.head<3>() / p.w() - place).dot(direction));
    return least;
}

struct PatchPart {
    BezierPatch shape;
    std::size_t patch;
    Vec2d lower, upper;  // of the whole patch's parameters
    double nearest;      // a lower bound
    bool all;            // the mask leaves all of it

    bool operator<(const PatchPart& other) const { return nearest > other.nearest; }  // the nearest first
};

class ClosestPointSearch {
public:
    ClosestPointSearch(std::span<const BezierPatch> patches, const Vec3d& place, const ClosestPointOptions& options)
        : patches_(patches), place_(place), options_(options) {}

    std::optional<ClosestPoint> run() {
        for (std::size_t k = 0; k < patches_.size(); ++k)
            consider({patches_[k], k, Vec2d::Zero(), Vec2d::Ones(), 0, options_.mask == nullptr});
        std::size_t looked = 0;
        double least = std::numeric_limits<double>::infinity();  // of what is left out
        while (!open_.empty()) {
            if (open_.top().nearest >= best_.distance - options_.tolerance || ++looked > options_.maxParts) {
                least = open_.top().nearest;
                break;
            }
            PatchPart part = open_.top();
            open_.pop();
            if ((part.upper - part.lower).maxCoeff() < kSmallest) {
                finest_ = std::min(finest_, part.nearest);
                continue;
            }
            halve(part);
        }
        if (!(best_.distance < std::numeric_limits<double>::infinity())) return std::nullopt;
        best_.error = std::max(0.0, best_.distance - std::min({least, finest_, best_.distance}));
        return best_;
    }

private:
    static constexpr double kSmallest = 1e-15;  // beyond it, halves are the whole

    void halve(const PatchPart& part) {
        // The side that is longer in space: parts stay round, as the bound by one direction wants them.
        const BezierPatch& s = part.shape;
        double longU = 0, longV = 0;
        for (int j = 0; j <= s.degreeV; ++j)
            for (int i = 0; i <= s.degreeU; ++i) {
                const Vec3d here = s.at(i, j).head<3>() / s.at(i, j).w();
                longU = std::max(longU, (here - s.at(0, j).head<3>() / s.at(0, j).w()).squaredNorm());
                longV = std::max(longV, (here - s.at(i, 0).head<3>() / s.at(i, 0).w()).squaredNorm());
            }
        const Vec2d size = part.upper - part.lower;
        const bool alongU = size.y() < kSmallest || (size.x() >= kSmallest && longU >= longV);
        std::array<BezierPatch, 2> halves = split(s, alongU ? PatchAxis::kU : PatchAxis::kV);
        const int axis = alongU ? 0 : 1;
        const double middle = 0.5 * (part.lower[axis] + part.upper[axis]);
        for (int k = 0; k < 2; ++k) {
            PatchPart half{std::move(halves[static_cast<std::size_t>(k)]),
                           part.patch,
                           part.lower,
                           part.upper,
                           part.nearest,
                           part.all};
            (k == 0 ? half.upper : half.lower)[axis] = middle;
            consider(std::move(half));
        }
    }

    void consider(PatchPart part) {
        if (!part.all) {
            const PatchMask::Part counts = options_.mask->partOf(part.patch, part.lower, part.upper);
            if (counts == PatchMask::Part::kNone) return;
            part.all = counts == PatchMask::Part::kAll;
        }
        const Vec2d middle = 0.5 * (part.lower + part.upper);
        const Vec3d there = evaluate(part.shape, 0.5, 0.5).point;
        part.nearest = std::max(part.nearest, distanceToBox(boxOf(part.shape), place_));
        const double away = (there - place_).norm();
        if (away > 0) part.nearest = std::max(part.nearest, leastAlong(part.shape, place_, (there - place_) / away));
        if (part.nearest >= best_.distance) return;
        if (!part.all) {
            const Vec2d &low = part.lower, &high = part.upper;
            for (const Vec2d& corner : {low, high, Vec2d(low.x(), high.y()), Vec2d(high.x(), low.y())})
                offer(part.patch, corner);
        }
        if (offer(part.patch, middle)) descend(part.patch, middle);
        open_.push(std::move(part));
    }

    /// Whether it is the best so far.
    bool offer(std::size_t patch, const Vec2d& at) {
        const Vec3d p = evaluate(patches_[patch], at.x(), at.y()).point;
        const double distance = (p - place_).norm();
        if (!(distance < best_.distance) || (options_.mask && !options_.mask->has(patch, at))) return false;
        best_ = {.patch = patch, .u = at.x(), .v = at.y(), .point = p, .distance = distance, .error = 0};
        return true;
    }

    /// Gauss-Newton, as long as it gets nearer; what runs into an edge of the patch goes along it.
    void descend(std::size_t patch, Vec2d at) {
        for (int step = 0; step < 30; ++step) {
            const SurfacePoint p = evaluate(patches_[patch], at.x(), at.y());
            const Vec3d off = place_ - p.point;
            Eigen::Matrix2d a;
            a << p.du.dot(p.du), p.du.dot(p.dv), p.du.dot(p.dv), p.dv.dot(p.dv);
            Vec2d b(p.du.dot(off), p.dv.dot(off));
            for (int k = 0; k < 2; ++k)
                if ((at[k] <= 0 && b[k] < 0) || (at[k] >= 1 && b[k] > 0)) {
                    a(0, 1) = a(1, 0) = b[k] = 0;
                    a(k, k) = 1;
                }
            const double determinant = a.determinant();
            if (!(determinant > 1e-14 * a(0, 0) * a(1, 1))) return;
            const Vec2d to =
                (at + Vec2d(a(1, 1) * b.x() - a(0, 1) * b.y(), a(0, 0) * b.y() - a(1, 0) * b.x()) / determinant)
                    .cwiseMax(0)
                    .cwiseMin(1);
            if (!to.allFinite() || to == at || !offer(patch, to)) return;
            at = to;
        }
    }

    std::span<const BezierPatch> patches_;
    Vec3d place_;
    const ClosestPointOptions& options_;
    std::priority_queue<PatchPart> open_;
    ClosestPoint best_{.patch = 0,
                       .u = 0,
                       .v = 0,
                       .point = Vec3d::Zero(),
                       .distance = std::numeric_limits<double>::infinity(),
                       .error = 0};
    double finest_ = std::numeric_limits<double>::infinity();
};

}  // namespace

std::optional<ClosestPoint> closestPoint(std::span<const BezierPatch> patches, const Vec3d& place,
                                         const ClosestPointOptions& options) {
    if (!place.allFinite()) return std::nullopt;
    return ClosestPointSearch(patches, place, options).run();
}

}  // namespace tessera
