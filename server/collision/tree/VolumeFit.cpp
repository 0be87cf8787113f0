#include "server/collision/tree/VolumeFit.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "server/collision/volume/KDop.h"

namespace tessera {
namespace {

using kernel::kLeafFaces;
using kernel::kLeafRows;
using kernel::kWidth;

float roundedUp(double x) {
    const float f = static_cast<float>(x);
    return static_cast<double>(f) >= x ? f : std::nextafter(f, std::numeric_limits<float>::infinity());
}

class Fitter {
public:
    explicit Fitter(TreeStorage& tree) : tree_(tree), rows_(rowsOf(tree.options.volume)) {}

    void fit() {
        fillCorners();
        tree_.volumes.assign(tree_.nodeCount() * rows_, {});
        for (std::size_t slot = 0; slot < tree_.children.size(); ++slot) clear(slot);
        tree_.cost = 0;
        fitBelow(0);
    }

private:
    TreeStorage& tree_;
    unsigned rows_;
    std::vector<Vec3d> points_;  ///< all corners, leaf by leaf, in the tree's coordinates, before rounding
    std::vector<std::uint32_t> firstPoint_;  ///< per leaf

    float& cell(std::size_t slot, unsigned row) { return tree_.volumes[slot / kWidth * rows_ + row].lane[slot % kWidth]; }

    void fillCorners() {
        const std::size_t leaves = tree_.leafCount();
        tree_.corners.assign(leaves * kLeafRows, {});
        points_.reserve(tree_.mesh.faceCount() * 3);
        firstPoint_.resize(leaves + 1);
        double radius2 = 0;
        for (std::size_t leaf = 0; leaf < leaves; ++leaf) {
            firstPoint_[leaf] = static_cast<std::uint32_t>(points_.size());
            for (unsigned i = 0; i < kLeafFaces; ++i) {
                const std::uint32_t face = tree_.leafFaces[leaf * kLeafFaces + i];
                if (face == TreeStorage::kNoFace) continue;
                for (unsigned c = 0; c < 3; ++c) {
                    const Vec3d p = (tree_.mesh.corner(face, c) - tree_.centre) * tree_.unit;
                    radius2 = std::max(radius2, p.squaredNorm());
                    points_.push_back(p);
                    for (int axis = 0; axis < 3; ++axis)
                        tree_.corners[leaf * kLeafRows + 3 * c + static_cast<unsigned>(axis)].lane[i] = static_cast<float>(p[axis]);
                }
            }
        }
        firstPoint_[leaves] = static_cast<std::uint32_t>(points_.size());
        tree_.radius = std::sqrt(radius2);
    }

    struct LeafRange {
        std::size_t first, end;
    };

    LeafRange fitBelow(std::size_t node) {
        LeafRange all{std::numeric_limits<std::size_t>::max(), 0};
        for (std::size_t slot = node * kWidth; slot < (node + 1) * kWidth; ++slot) {
            const kernel::ChildRef ref = tree_.children[slot];
            if (ref == kernel::kNoChild) continue;
            LeafRange range;
            if ((ref & kernel::kLeafBit) != 0) {
                const std::size_t leaf = (ref & ~kernel::kLeafBit) >> 2;
                range = {leaf, leaf + 1};
            } else {
                range = fitBelow(ref);
            }
            const std::uint32_t first = firstPoint_[range.first], end = firstPoint_[range.end];
            tree_.cost += fitOne(slot, {points_.data() + first, end - first});
            all.first = std::min(all.first, range.first);
            all.end = std::max(all.end, range.end);
        }
        return all;
    }

    /// The size of what was put there: the surface of a box, the like of others.
    double fitOne(std::size_t slot, std::span<const Vec3d> points) {
        switch (tree_.options.volume) {
            case VolumeKind::kSphere: return fitSphere(slot, points);
            case VolumeKind::kObb: return fitObb(slot, points);
            case VolumeKind::kAabb:
            case VolumeKind::kDop6: return fitDop(slot, points, DirectionSet::k6);
            case VolumeKind::kDop14: return fitDop(slot, points, DirectionSet::k14);
            case VolumeKind::kDop18: return fitDop(slot, points, DirectionSet::k18);
            case VolumeKind::kDop26: return fitDop(slot, points, DirectionSet::k26);
        }
        return 0;
    }

    /// Where there is no child: overlaps nothing.
    void clear(std::size_t slot) {
        constexpr float kNever = -1e30f;
        switch (tree_.options.volume) {
            case VolumeKind::kSphere: cell(slot, 3) = kNever; break;
            case VolumeKind::kObb:
                for (unsigned row = 12; row < 15; ++row) cell(slot, row) = kNever;
                break;
            default:
                for (unsigned row = 0; row < rows_; ++row) cell(slot, row) = kNever;
        }
    }

    double fitSphere(std::size_t slot, std::span<const Vec3d> points) {
        // Ritter 1990: from the ends of a long way across, grown by what lies outside.
        const auto farthest = [&](const Vec3d& from) {
            return *std::max_element(points.begin(), points.end(), [&](const Vec3d& p, const Vec3d& q) {
                return (p - from).squaredNorm() < (q - from).squaredNorm();
            });
        };
        const Vec3d p = farthest(points[0]), q = farthest(p);
        Vec3d centre = 0.5 * (p + q);
        double radius = 0.5 * (p - q).norm();
        for (const Vec3d& x : points) {
            const double away = (x - centre).norm();
            if (away <= radius) continue;
            radius = 0.5 * (radius + away);
            centre += (x - centre) * ((away - radius) / away);
        }
        const Vec3f rounded = centre.cast<float>();
        radius = 0;
        for (const Vec3d& x : points) radius = std::max(radius, (x - rounded.cast<double>()).norm());
        for (unsigned axis = 0; axis < 3; ++axis) cell(slot, axis) = rounded[axis];
        cell(slot, 3) = roundedUp(radius * (1 + 1e-15));
        return 4 * 3.14159265358979 * radius * radius;
    }

    struct Frame {
        Mat3d axes;  ///< rows
        Vec3d lower, upper;
        double area = std::numeric_limits<double>::infinity();
    };

    static Frame around(const Mat3d& axes, std::span<const Vec3d> points) {
        Frame frame{axes, axes * points[0], axes * points[0]};
        for (const Vec3d& p : points) {
            const Vec3d x = axes * p;
            frame.lower = frame.lower.cwiseMin(x);
            frame.upper = frame.upper.cwiseMax(x);
        }
        const Vec3d size = frame.upper - frame.lower;
        frame.area = 2 * (size.x() * size.y() + size.y() * size.z() + size.z() * size.x());
        return frame;
    }

    /// Principal axes of the surface (Gottschalk, Lin, Manocha 1996), or the model's own where that box is smaller.
    double fitObb(std::size_t slot, std::span<const Vec3d> points) {
        double area = 0;
        Vec3d mean = Vec3d::Zero();
        Mat3d second = Mat3d::Zero();
        const Vec3d origin = points[0];
        for (std::size_t i = 0; i + 2 < points.size(); i += 3) {
            const Vec3d a = points[i] - origin, b = points[i + 1] - origin, c = points[i + 2] - origin;
            const double weight = (b - a).cross(c - a).norm() + 1e-300;
            const Vec3d sum = a + b + c;
            area += weight;
            mean += weight / 3 * sum;
            second += weight / 12 * (sum * sum.transpose() + a * a.transpose() + b * b.transpose() + c * c.transpose());
        }
        mean /= area;
        Frame best = around(Mat3d::Identity(), points);
        const Mat3d covariance = second / area - mean * mean.transpose();
        Eigen::SelfAdjointEigenSolver<Mat3d> solver;
        solver.computeDirect(covariance);
        Vec3d x = solver.eigenvectors().col(2), y = solver.eigenvectors().col(1);
        if (x.allFinite() && y.allFinite() && x.norm() > 0.5) {
            x.normalize();
            y -= y.dot(x) * x;
            if (y.norm() > 0.1) {
                y.normalize();
                Mat3d axes;
                axes << x.transpose(), y.transpose(), x.cross(y).transpose();
                const Frame frame = around(axes, points);
                if (frame.area < best.area) best = frame;
            }
        }
        const Eigen::Matrix3f axes = best.axes.cast<float>();
        const Vec3f centre = (best.axes.transpose() * (0.5 * (best.lower + best.upper))).cast<float>();
        Vec3d half = Vec3d::Zero();
        for (const Vec3d& p : points)
            half = half.cwiseMax((axes.cast<double>() * (p - centre.cast<double>())).cwiseAbs());
        for (unsigned i = 0; i < 3; ++i) {
            cell(slot, i) = centre[i];
            for (unsigned axis = 0; axis < 3; ++axis) cell(slot, 3 + 3 * i + axis) = axes(i, axis);
            cell(slot, 12 + i) = roundedUp(half[i] * (1 + 1e-15));
        }
        return best.area;
    }

    double fitDop(std::size_t slot, std::span<const Vec3d> points, DirectionSet set) {
        const KDop dop = KDop::around(set, points);
        const unsigned n = static_cast<unsigned>(dop.count());
        for (unsigned i = 0; i < 2 * n; ++i) cell(slot, i) = roundedUp(dop.halfPlane(i));
        const double x = dop.upper[0] - dop.lower[0], y = dop.upper[1] - dop.lower[1], z = dop.upper[2] - dop.lower[2];
        return 2 * (x * y + y * z + z * x);
    }
};

}  // namespace

void fitVolumes(TreeStorage& tree) {
    if (!tree.empty()) Fitter(tree).fit();
}

}  // namespace tessera
