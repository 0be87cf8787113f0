#include "server/collision/freeform/PartBounds.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/math/Decompositions.h"
#include "server/collision/freeform/PartChoice.h"

namespace tessera {
namespace {

/// The largest factor by which a map stretches, rounded up.
/// Into the part's domain.
Vec2d clamped(const FreeformPart& part, Vec2d at) {
    at = at.cwiseMax(0).cwiseMin(1);
    if (part.kind == FreeformPart::Kind::kTriangle) {
        const double over = at.sum() - 1;
        if (over > 0) {
            at -= Vec2d::Constant(0.5 * over);
            if (at.x() < 0) at = {0, 1};
            if (at.y() < 0) at = {1, 0};
        }
    }
    return at;
}

/// Takes away columns along which a step would leave the domain; on the long side of a triangle what is left leads
/// along it.
void holdAtEdges(const FreeformPart& part, const Vec2d& at, const Vec3d& downhill, Vec3d& ds, Vec3d& dt) {
    const double alongS = ds.dot(downhill), alongT = dt.dot(downhill);
    if (part.kind == FreeformPart::Kind::kTriangle && at.sum() >= 1 - 1e-15 && alongS + alongT > 0) {
        const Vec3d along = 0.5 * (ds - dt);
        ds = along;
        dt = -along;
    }
    if ((at.x() <= 0 && alongS < 0) || (at.x() >= 1 && alongS > 0)) ds.setZero();
    if ((at.y() <= 0 && alongT < 0) || (at.y() >= 1 && alongT > 0)) dt.setZero();
}

/// Lengths change by less than slack is made for.
bool isRigid(const Mat3d& m) {
    return ((m.transpose() * m - Mat3d::Identity()).array().abs() <= 4 * std::numeric_limits<double>::epsilon()).all();
}

std::optional<Mat3d> normalMap(const Mat3d& linear) {
    Mat3d inverse;
    bool invertible = false;
    double determinant = 0;
    linear.computeInverseAndDetWithCheck(inverse, determinant, invertible, 0);
    if (!invertible || !inverse.allFinite()) return std::nullopt;
    return Mat3d(inverse.transpose());
}

}  // namespace

void PartBounds::place(const Affine3d& a, const Affine3d& b, double reach) {
    mapA_ = a;
    mapB_ = b;
    toA_ = a.linear().transpose();
    toB_ = b.linear().transpose();
    normalsA_ = normalMap(a.linear());
    normalsB_ = normalMap(b.linear());
    stretchA_ = stretchOf(a.linear());
    stretchB_ = stretchOf(b.linear());
    isStillA_ = a.matrix().isIdentity(0);
    isRigidA_ = isRigid(a.linear());
    isRigidB_ = isRigid(b.linear());
    if (areRigid()) {
        a_T_b_.linear() = toA_ * b.linear();
        a_T_b_.translation() = toA_ * (b.translation() - a.translation());
        b_T_a_.linear() = toB_ * a.linear();
        b_T_a_.translation() = toB_ * (a.translation() - b.translation());
    }
    boxAxes_ = 0;
    for (const std::optional<Mat3d>* normals : {&normalsA_, &normalsB_})
        for (Eigen::Index k = 0; *normals && k < 3; ++k) {
            const Vec3d n = (*normals)->col(k).normalized();
            if (n.allFinite() && !n.isZero()) axes_[boxAxes_++] = boxAxis(n);
        }
    // A hull's point is a convex sum of control points, some 50 halvings of which each rounds by half a unit; then a
    // map and a dot product.
    slack_ = 64 * std::numeric_limits<double>::epsilon() * reach;
}

PartBounds::Gap PartBounds::gap(const FreeformPart& a, const FreeformPart& b, double enough,
                                const std::optional<Vec3d>& hint) const {
    const Vec3d ca = centerA(a), cb = centerB(b), between = cb - ca;
    const double apart = between.norm();
    Gap best{apart - radiusA(a) - radiusB(b) - slack_, Vec3d::UnitX(), apart};
    if (apart > 0) best.along = between / apart;
    if (best.length >= enough || !(apart > 0)) return best;
    if (a.kind == FreeformPart::Kind::kGroup && b.kind == FreeformPart::Kind::kGroup)
        return boxGap(a, b, between, enough, hint, best);
    if (hint) {
        offerAlong(a, b, *hint, best);
        if (best.length >= enough) return best;
    }
    const auto offer = [&](const Vec3d& n, double most, double least) {
        if (least - most - slack_ > best.length) best = {least - most - slack_, n, apart};
    };
    const auto mostOfA = [&](const Vec3d& n) { return a_.extentAlong(a, toA_ * n).most + n.dot(mapA_.translation()); };
    const auto leastOfB = [&](const Vec3d& n) {
        return b_.extentAlong(b, toB_ * n).least + n.dot(mapB_.translation());
    };
    if (normalsA_) {
        Vec3d n = *normalsA_ * a.normal;
        const double length = isRigidA_ ? 1 : n.norm();
        if (!isRigidA_) n /= length;
        const bool turned = n.dot(between) < 0;
        const double most = (turned ? -a.low : a.high) / length;
        if (turned) n = -n;
        if (std::isfinite(length) && length > 0) offer(n, n.dot(ca) + most, leastOfB(n));
        if (best.length >= enough) return best;
    }
    if (normalsB_) {
        Vec3d n = *normalsB_ * b.normal;
        const double length = isRigidB_ ? 1 : n.norm();
        if (!isRigidB_) n /= length;
        const bool turned = n.dot(between) < 0;
        const double least = (turned ? -b.high : b.low) / length;
        if (turned) n = -n;
        if (std::isfinite(length) && length > 0) offer(n, mostOfA(n), n.dot(cb) + least);
        if (best.length >= enough) return best;
    }
    offerAlong(a, b, between / apart, best);
    return best;
}

void PartBounds::offerAlong(const FreeformPart& a, const FreeformPart& b, const Vec3d& along, Gap& best) const {
    const double most = a_.extentAlong(a, toA_ * along).most + along.dot(mapA_.translation());
    const double length = b_.extentAlong(b, toB_ * along).least + along.dot(mapB_.translation()) - most - slack_;
    if (length > best.length) best = {length, along, best.apart};
}

PartBounds::BoxAxis PartBounds::boxAxis(const Vec3d& along) const {
    return {along, (toA_ * along).cwiseAbs(), (toB_ * along).cwiseAbs()};
}

/// Of two boxes: along their sides, which are the same for all pairs.
PartBounds::Gap PartBounds::boxGap(const FreeformPart& a, const FreeformPart& b, const Vec3d& between, double enough,
                                   const std::optional<Vec3d>& hint, Gap best) const {
    const Vec3d halfA = a_.boxHalf(a), halfB = b_.boxHalf(b);
    const auto offer = [&](const BoxAxis& axis) {
        const double apart = axis.along.dot(between),
                     gap = std::abs(apart) - axis.reachA.dot(halfA) - axis.reachB.dot(halfB) - slack_;
        if (gap > best.length) best = {gap, apart < 0 ? Vec3d(-axis.along) : axis.along, best.apart};
    };
    if (hint) offer(boxAxis(*hint));
    for (std::size_t k = 0; k < boxAxes_ && best.length < enough; ++k) offer(axes_[k]);
    if (best.length < enough) offer(boxAxis(between.normalized()));
    return best;
}

void PartBounds::gaps(const PartBlock& block, const PartBox& one, const Affine3d& block_T_one, const Vec3d& hint,
                      Gaps& least) const {
    kernel::BoxOfOne other;
    Eigen::Map<Vec3d>(other.middle) = block_T_one * one.middle;
    Eigen::Map<Mat3d>(other.axes) = block_T_one.linear().lazyProduct(one.axes);
    Eigen::Map<Vec3d>(other.half) = one.half;
    Eigen::Map<Vec3d>(other.hint) = hint;
    gapsOfBoxes_(block.boxes.data(), block.count, other, least.data());
    // The map's rounding and the kernel's own, beside that of points.
    for (std::uint32_t lane = 0; lane < block.count; ++lane) least[lane] -= 2 * slack_;
}

PlacePair PartBounds::samples(std::uint32_t a, std::uint32_t b) const {
    const FreeformPart &pa = a_[a], &pb = b_[b];
    PlacePair out{.a = a, .b = b, .inA = pa.middle, .inB = pb.middle, .onA = centerA(pa), .onB = centerB(pb)};
    out.distance = (out.onB - out.onA).norm();
    return out;
}

bool PartBounds::isThere(const PlacePair& at) const {
    return a_.isThere(a_[at.a], at.inA.x(), at.inA.y()) && b_.isThere(b_[at.b], at.inB.x(), at.inB.y());
}

PlacePair PartBounds::descend(PlacePair from, double enough, int steps, double slow) const {
    const FreeformPart &a = a_[from.a], &b = b_[from.b];
    const bool moveA = hasParameters(a), moveB = hasParameters(b);
    if (!moveA && !moveB) return from;
    const auto pointOf = [](const FreeformParts& parts, const FreeformPart& part, const Affine3d& map,
                            const Vec2d& at) {
        PartPoint p = parts.evaluate(part, at.x(), at.y());
        p.point = map * p.point;
        p.ds = map.linear() * p.ds;
        p.dt = map.linear() * p.dt;
        return p;
    };
    const auto pointA = [&](const Vec2d& at) {
        return moveA ? pointOf(a_, a, mapA_, at) : PartPoint{from.onA, Vec3d::Zero(), Vec3d::Zero()};
    };
    const auto pointB = [&](const Vec2d& at) {
        return moveB ? pointOf(b_, b, mapB_, at) : PartPoint{from.onB, Vec3d::Zero(), Vec3d::Zero()};
    };
    PartPoint onA = pointA(from.inA), onB = pointB(from.inB);
    double damping = 1e-4;
    for (int step = 0; step < steps && from.distance > enough; ++step) {
        const Vec3d off = onB.point - onA.point;
        Vec3d as = onA.ds, at = onA.dt, bs = onB.ds, bt = onB.dt;
        holdAtEdges(a, from.inA, off, as, at);
        holdAtEdges(b, from.inB, -off, bs, bt);
        // The shortest step in parameters that takes A's and B's points to each other as far as their tangents reach:
        // three equations.
        Mat3d m = as * as.transpose() + at * at.transpose() + bs * bs.transpose() + bt * bt.transpose();
        const double size = m.trace();
        if (!(size > 0)) break;
        bool nearer = false;
        for (int attempt = 0; attempt < 3 && !nearer; ++attempt, damping = std::min(damping * 64, 1e3)) {
            Mat3d damped = m / size;
            damped.diagonal().array() += damping;
            const Vec3d pull = damped.inverse() * (off / size);
            const Vec2d toA = clamped(a, from.inA + Vec2d(as.dot(pull), at.dot(pull))),
                        toB = clamped(b, from.inB - Vec2d(bs.dot(pull), bt.dot(pull)));
            if (!toA.allFinite() || !toB.allFinite()) return from;
            const PartPoint nextA = moveA ? pointA(toA) : onA, nextB = moveB ? pointB(toB) : onB;
            const double distance = (nextB.point - nextA.point).norm();
            if (distance < from.distance) {
                nearer = true;
                const bool isLast = distance > slow * from.distance;
                from.inA = moveA ? toA : from.inA;
                from.inB = moveB ? toB : from.inB;
                from.onA = nextA.point;
                from.onB = nextB.point;
                from.distance = distance;
                onA = nextA;
                onB = nextB;
                if (isLast) return from;
            }
        }
        if (!nearer) break;
        damping = std::max(damping / 4096, 1e-12);
    }
    return from;
}

Vec3d PartBounds::normalOf(const FreeformParts& parts, const FreeformPart& part, const Affine3d& map, const Vec2d& at) {
    const bool known = part.hasSample && part.kind == FreeformPart::Kind::kNeighbourhood;
    Vec3d n = Vec3d::Zero();
    if (hasParameters(part)) {
        const PartPoint p = parts.evaluate(part, at.x(), at.y());
        n = normalAlong(map.linear() * p.ds, map.linear() * p.dt);
    } else if (known) {
        const std::optional<Mat3d> normals = normalMap(map.linear());
        if (normals) n = (*normals * parts.normalAtSample(part)).normalized();
    }
    // Halves of triangles may be turned over in their parameters.
    const double turn = part.alongU.x() * part.alongV.y() - part.alongU.y() * part.alongV.x();
    if (map.linear().determinant() < 0 && known) n = -n;
    return turn < 0 && hasParameters(part) ? Vec3d(-n) : n;
}

}  // namespace tessera
