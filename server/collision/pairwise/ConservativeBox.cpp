#include "server/collision/pairwise/ConservativeBox.h"

#include <cmath>

namespace tessera {

namespace {

// A mapped vertex is off by a few units in the last place of the sums that made it.
constexpr double kSlack = 4e-15;

}  // namespace

bool invertible(const Affine3d& m) {
    // Nearly always: coefficients of the inverse, cofactors over the determinant, are then below 1e26. Not so a NaN.
    constexpr double kUsual = 1e6;
    const double determinant = m.linear().determinant();
    if (m.matrix().cwiseAbs().maxCoeff<Eigen::PropagateNaN>() < kUsual && std::abs(determinant) > 1 / kUsual)
        return true;
    if (!m.matrix().allFinite()) return false;
    const Affine3d inverse = m.inverse();
    return inverse.matrix().allFinite() && std::abs(determinant) > 1e-120 && m.matrix().cwiseAbs().maxCoeff() < 1e50 &&
           inverse.matrix().cwiseAbs().maxCoeff() < 1e50;
}

std::optional<double> similarityScale(const Affine3d& m) {
    const Mat3d square = m.linear().transpose() * m.linear();
    const double s2 = square.trace() / 3;
    if (!(s2 > 0) || !((square - s2 * Mat3d::Identity()).cwiseAbs().maxCoeff() <= 1e-12 * s2)) return std::nullopt;
    return std::sqrt(s2);
}

Box boxAround(const Affine3d& to_T_from, const Box& box) {
    if (box.empty()) return {};
    const Vec3d center = 0.5 * (box.lower + box.upper);
    const Vec3d half = 0.5 * (box.upper - box.lower);
    const Mat3d magnitude = to_T_from.linear().cwiseAbs();
    const Vec3d shift = to_T_from.translation().cwiseAbs();
    const Vec3d reach = magnitude * half + kSlack * (magnitude * (center.cwiseAbs() + half) + shift);
    const Vec3d c = to_T_from * center;
    Box out;
    out.lower = c - reach;
    out.upper = c + reach;
    return out;
}

Box boxAround(const Affine3d& to_T_from, const Box& box, const Vec3d& ballCentre, double ballRadius) {
    Box out = boxAround(to_T_from, box);
    // A ball's image is an ellipsoid, which reaches as far along an axis as the row of the map is long.
    const Mat3d magnitude = to_T_from.linear().cwiseAbs();
    const Vec3d shift = to_T_from.translation().cwiseAbs();
    const Vec3d farthest = ballCentre.cwiseAbs() + Vec3d::Constant(ballRadius);
    const Vec3d reach = ballRadius * to_T_from.linear().rowwise().norm() + kSlack * (magnitude * farthest + shift);
    const Vec3d c = to_T_from * ballCentre;
    out.lower = out.lower.cwiseMax(c - reach);
    out.upper = out.upper.cwiseMin(c + reach);
    return out;
}

}  // namespace tessera
