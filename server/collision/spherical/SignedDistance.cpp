// Two bodies: one's tree is walked, its boxes looked up in the other's lattice; and, where they meet, the other way
// round.
#include <algorithm>
#include <cmath>
#include <limits>

#include "common/math/Decompositions.h"
#include "server/collision/query/DistanceQuery.h"
#include "server/collision/spherical/DistanceLattice.h"
#include "server/collision/spherical/FieldKernels.h"
#include "server/collision/tree/TreeStorage.h"

namespace tessera {
namespace {

/// The least signed distance of a tree's surface from a lattice's body, in the lattice's lengths.
struct OneSide {
    double lower = 0, upper = 0;
    Vec3d point = Vec3d::Zero();  ///< in the lattice's frame
    bool complete = true;
};

/// `scale`: at least the largest stretch of the map. `most`: nothing farther is of interest.
OneSide oneSide(const TriangleTree& walked, const DistanceLattice& lattice, const Affine3d& lattice_T_walked,
                double scale, double width, QueryWork& work, bool sides = true,
                double most = std::numeric_limits<double>::infinity()) {
    const TreeStorage &w = walked.storage(), &l = lattice.tree().storage();
    kernel::LatticeFrame frame{};
    frame.tree = w.view();
    frame.surface = l.view();
    frame.lattice = lattice.view();
    frame.lattice.isSigned = sides && lattice.isSigned();
    const Mat3d linear = lattice_T_walked.linear() * (l.unit / w.unit);
    const Vec3d shift = (lattice_T_walked * w.centre - l.centre) * l.unit;
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column)
            frame.linear[3 * row + column] = static_cast<float>(linear(row, column));
        frame.translation[row] = static_cast<float>(shift[row]);
    }
    const double stretch = scale * l.unit / w.unit;
    frame.scale = static_cast<float>(stretch);
    frame.slack = static_cast<float>(4e-6 * (l.radius + stretch * w.radius + shift.norm()));
    kernel::LatticeSink sink{};
    sink.width = static_cast<float>(width * l.unit);
    sink.lower = 3e38F;
    sink.upper = static_cast<float>(std::min(3e38, most * l.unit));
    sink.nodeTests = work.boxTests;
    sink.triangleTests = work.triangleTests;
    sink.limit = work.limit;
    kernel::fieldKernels().lattice(frame, sink);
    work.boxTests = sink.nodeTests;
    work.triangleTests = sink.triangleTests;
    OneSide out;
    out.upper = static_cast<double>(sink.upper) / l.unit;
    out.lower = std::min(out.upper, static_cast<double>(sink.lower) / l.unit);
    for (int r = 0; r < 3; ++r) out.point[r] = static_cast<double>(sink.point[r]) / l.unit + l.centre[r];
    out.complete = !sink.exhausted;
    return out;
}

/// Uniform scale of a similarity; 0 for other maps.
double scaleOf(const Affine3d& m) {
    if (!m.matrix().allFinite()) return 0;
    const Mat3d gram = m.linear().transpose() * m.linear();
    const double square = gram.trace() / 3;
    if (!(square > 1e-18 && square < 1e18)) return 0;
    return (gram - square * Mat3d::Identity()).cwiseAbs().maxCoeff() <= 1e-9 * square ? std::sqrt(square) : 0;
}

/// What floats can walk over: a map that is finite, and neither enlarges nor moves beyond all measure.
Expected<double> walkable(const DistanceLattice& field, const TriangleTree& other, const Affine3d& field_T_other) {
    const TreeStorage &f = field.tree().storage(), &o = other.storage();
    if (o.empty()) return fail(ErrorCode::kBadInput, "a mesh without triangles has no distances");
    if (o.options.volume != VolumeKind::kObb)
        return fail(ErrorCode::kBadInput, "distances need a tree of oriented boxes");
    const double stretch = stretchOf(field_T_other.linear());
    if (!field_T_other.matrix().allFinite() || !(stretch > 1e-9 && stretch < 1e9))
        return fail(ErrorCode::kBadInput, "distances need a finite map that stretches by 1e-9 to 1e9");
    const double sizes = f.radius / f.unit + stretch * o.radius / o.unit;
    if (!((field_T_other * o.centre - f.centre).norm() <= 1e6 * sizes))
        return fail(ErrorCode::kBadInput, "bodies a million times farther apart than they are large");
    return stretch;
}

SignedDistance exhausted() {
    SignedDistance out;
    out.complete = false;
    out.error = std::numeric_limits<double>::infinity();
    return out;
}

}  // namespace

Expected<SignedDistance> surfaceDistance(const DistanceLattice& field, const TriangleTree& other,
                                         const Affine3d& field_T_other, double upperBound, QueryWork& work) {
    const Expected<double> stretch = walkable(field, other, field_T_other);
    if (!stretch) return tl::unexpected(stretch.error());
    if (work.exhausted()) return exhausted();
    const double width = 1.9 * field.error();
    const OneSide found = oneSide(other, field, field_T_other, *stretch, width, work, false, upperBound + width);
    SignedDistance out;
    out.complete = found.complete;
    // Whatever has been left out is farther than the least that has been found less the width.
    out.farther = found.complete && (found.lower >= upperBound || !(found.upper < 0.999999 * (upperBound + width)));
    if (out.farther) {
        out.distance = upperBound;
        return out;
    }
    if (found.complete && found.lower > 0 && found.upper - found.lower > 2 * field.error()) {
        // Too far for the lattice.
        const Distance exact = distanceBetween(field.tree(), other, field_T_other, work, {.upperBound = upperBound});
        if (exact.complete) {
            out.exact = true;
            out.farther = exact.farther;
            out.distance = exact.distance;
            out.error = 1e-12 * (exact.distance + field_T_other.translation().norm());
            out.point = exact.onB;
            if (!exact.farther && exact.distance > 0) out.normal = (exact.onB - exact.onA) / exact.distance;
            return out;
        }
    }
    out.distance = 0.5 * (found.lower + found.upper);
    out.error = 0.5 * (found.upper - found.lower);
    out.point = found.point;
    out.normal = field.gradient(found.point);
    return out;
}

Expected<SignedDistance> signedDistance(const DistanceLattice& field, const TriangleTree& other,
                                        const Affine3d& field_T_other, QueryWork& work) {
    const Expected<double> stretch = walkable(field, other, field_T_other);
    if (!stretch) return tl::unexpected(stretch.error());
    if (!field.isSigned()) return fail(ErrorCode::kBadInput, "an open surface has no inside");
    if (work.exhausted()) return exhausted();
    const OneSide found = oneSide(other, field, field_T_other, *stretch, 1.9 * field.error(), work);
    SignedDistance out;
    out.complete = found.complete;
    out.distance = 0.5 * (found.lower + found.upper);
    out.error = 0.5 * (found.upper - found.lower);
    out.point = found.point;
    out.normal = field.gradient(found.point);
    return out;
}

Expected<SignedDistance> signedDistance(const DistanceLattice& a, const DistanceLattice& b, const Affine3d& a_T_b,
                                        QueryWork& work) {
    const double scale = scaleOf(a_T_b);
    if (scale == 0)
        return fail(ErrorCode::kBadInput,
                    "signed distances need a map of rotation, uniform scale and translation, within 1e-9 to 1e9");
    const Affine3d b_T_a = a_T_b.inverse(Eigen::Affine);
    if (!(a_T_b.translation().norm() <= 1e6 * (a.tree().storage().radius / a.tree().storage().unit +
                                               scale * b.tree().storage().radius / b.tree().storage().unit)))
        return fail(ErrorCode::kBadInput, "bodies a million times farther apart than they are large");
    if (work.exhausted()) return exhausted();
    SignedDistance out;
    const double error = std::max(a.error(), scale * b.error()), width = 1.9 * error;

    // A's surface in B's lattice, in A's lengths.
    const OneSide first = oneSide(a.tree(), b, b_T_a, 1 / scale, width / scale, work);
    double lower = scale * first.lower, upper = scale * first.upper;
    Vec3d point = a_T_b * first.point, normal = -(a_T_b.linear() * b.gradient(first.point));
    out.complete = first.complete;
    // A's surface is apart from B, but a piece of B may be within A. Without a sign the first was all.
    const bool apart =
        !a.isSigned() || (lower > 0 && !a.tree().mesh().bounds().overlaps(b.tree().mesh().bounds().transformed(a_T_b)));
    if (!apart) {
        const OneSide second = oneSide(b.tree(), a, a_T_b, scale, width, work);
        out.complete = out.complete && second.complete;
        if (second.upper < upper) {
            point = second.point;
            normal = a.gradient(second.point);
        }
        lower = std::min(lower, second.lower);
        upper = std::min(upper, second.upper);
    }
    if (upper - lower > 2 * error && lower > 0 && out.complete) {
        // Too far for the lattice.
        const Distance exact = distanceBetween(a.tree(), b.tree(), a_T_b, work);
        if (exact.complete && exact.distance > 0) {
            out.distance = exact.distance;
            out.error = 1e-12 * (exact.distance + a_T_b.translation().norm());
            out.point = 0.5 * (exact.onA + exact.onB);
            out.normal = (exact.onB - exact.onA) / exact.distance;
            out.exact = true;
            return out;
        }
    }
    out.distance = 0.5 * (lower + upper);
    out.error = 0.5 * (upper - lower);
    out.point = point;
    const double length = normal.norm();
    out.normal = length > 0 ? Vec3d(normal / length) : Vec3d(Vec3d::Zero());
    return out;
}

}  // namespace tessera
