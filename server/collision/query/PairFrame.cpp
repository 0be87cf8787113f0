#include "server/collision/query/PairFrame.h"

#include <algorithm>
#include <cmath>

#include "server/collision/query/RealignedPlanes.h"
#include "server/collision/tree/ProfileFit.h"
#include "server/collision/tree/TreeStorage.h"

namespace tessera {
namespace {

using kernel::PairFrame;
using kernel::PairMap;

/// Beyond this, cubes of lengths leave float.
constexpr double kMostStretch = 1e9;
/// A position goes through at most some dozen roundings of 2^-24 of the lengths involved.
constexpr double kSlack = 4e-6;

void setRows(float (&out)[9], const Mat3d& m) {
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column) out[3 * row + column] = static_cast<float>(m(row, column));
}

/// B's own coordinates to A's.
Affine3d ownMap(const TreeStorage& ta, const TreeStorage& tb, const Affine3d& a_T_b) {
    Affine3d own = Affine3d::Identity();
    own.linear() = a_T_b.linear() * (ta.unit / tb.unit);
    own.translation() = (a_T_b * tb.centre - ta.centre) * ta.unit;
    return own;
}

}  // namespace

DirectionSet directionsOf(VolumeKind kind) {
    switch (kind) {
        case VolumeKind::kDop14:
            return DirectionSet::k14;
        case VolumeKind::kDop18:
            return DirectionSet::k18;
        case VolumeKind::kDop26:
            return DirectionSet::k26;
        default:
            return DirectionSet::k6;
    }
}

PairFrame pairFrame(const TriangleTree& a, const TriangleTree& b, const Affine3d& a_T_b, Realignment realignment) {
    return pairFrame(a.storage(), b.storage(), a_T_b, realignment);
}

PairFrame pairFrame(const TreeStorage& ta, const TreeStorage& tb, const Affine3d& a_T_b, Realignment realignment) {
    const Affine3d own = ownMap(ta, tb, a_T_b);

    PairFrame f{};
    const Mat3d gram = own.linear().transpose() * own.linear();
    const double scale = std::sqrt(gram.trace() / 3);
    const double largest = std::max(own.linear().norm(), own.translation().norm());
    if (!(largest <= kMostStretch)) {
        f.slack = f.slackB = 1e30f;
        f.scale = 1;
        return f;
    }
    f.similarity =
        scale > 1e-9 && (gram - scale * scale * Mat3d::Identity()).cwiseAbs().maxCoeff() <= 1e-9 * scale * scale;
    f.scale = f.similarity ? static_cast<float>(scale) : 1;
    setRows(f.linear, own.linear());
    setRows(f.axes, f.similarity ? Mat3d(own.linear() / scale) : Mat3d(own.linear()));
    for (int i = 0; i < 3; ++i) f.translation[i] = static_cast<float>(own.translation()[i]);
    const double stretch =
        f.similarity ? scale : own.linear().norm();  // Frobenius' norm bounds the largest singular value
    f.stretch = static_cast<float>(stretch * (1 + 1e-6));
    // The coordinates that a_T_b itself is rounded in count too: those of the exact test are near |a_T_b · x|.
    const double inDouble = 1e-15 * ta.unit *
                            (a_T_b.linear().cwiseAbs() * (tb.centre.cwiseAbs() + Vec3d::Constant(1 / tb.unit)) +
                             a_T_b.translation().cwiseAbs() + ta.centre.cwiseAbs())
                                .norm();
    const double slack = kSlack * (ta.radius + stretch * tb.radius + own.translation().norm()) + inDouble;
    f.slack = static_cast<float>(slack * (1 + 1e-6));
    f.slackB = f.similarity ? static_cast<float>(slack / scale * (1 + 1e-6)) : 1e30f;
    // A in B's frame too, where that pays: for boxes always, for k-DOPs where B's are plates that look fat in A's
    // frame.
    const bool plates =
        realignment == Realignment::kInBothFrames || (realignment != Realignment::kInOneFrame && tb.thin);
    f.bothWays = f.similarity && (plates || shapeOf(tb.options.volume) == kernel::Shape::kDop6);
    if (ta.options.volume == VolumeKind::kSphere || ta.options.volume == VolumeKind::kObb) return f;
    const DirectionSet set = directionsOf(ta.options.volume);
    const PlaneChoice choice =
        realignment == Realignment::kBoxEnclosure ? PlaneChoice::kBoxEnclosure : PlaneChoice::kThreePlanes;
    realignPlanes(f.bInA, set, own, tb.radius, f.stretch, choice);
    if (f.bothWays) realignPlanes(f.aInB, set, own.inverse(Eigen::Affine), ta.radius, (1 + 1e-6) / scale, choice);
    return f;
}

kernel::ProfileLookups profileLookups(const TriangleTree& a, const TriangleTree& b, const Affine3d& a_T_b) {
    const TreeStorage& tb = b.storage();
    const ProfileShape shape = profileShape(tb.options.volume);
    KDop whole(shape.directions);
    const std::size_t n = whole.count();
    for (std::size_t i = 0; i < n; ++i) {
        whole.upper[i] = static_cast<double>(tb.volumes[i].lane[0]);
        whole.lower[i] = -static_cast<double>(tb.volumes[n + i].lane[0]);
    }
    const FloatProfileLookup lookup =
        forKernels(ProfileLookup::make(shape, shape.directions, ownMap(a.storage(), tb, a_T_b)), whole);
    kernel::ProfileLookups out{};
    out.entries = static_cast<std::uint32_t>(shape.size());
    for (std::size_t i = 0; i < 2 * n; ++i) {
        out.entry[i] = lookup.entry[i];
        std::copy_n(lookup.vector[i], 3, out.vector[i]);
        out.length[i] = lookup.length[i];
        out.offset[i] = lookup.offset[i];
    }
    return out;
}

PairMap pairMap(const TriangleTree& a, const TriangleTree& b, const Affine3d& a_T_b) {
    return pairMap(a.mesh().bounds(), b.mesh().bounds(), a_T_b);
}

PairMap pairMap(const Box& boundsA, const Box& boundsB, const Affine3d& a_T_b) {
    PairMap map;
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) map.linear[3 * row + column] = a_T_b.linear()(row, column);
        map.translation[row] = a_T_b.translation()[row];
    }
    const auto magnitude = [](const Box& box) { return Vec3d(box.lower.cwiseAbs().cwiseMax(box.upper.cwiseAbs())); };
    // With u = 2^-53: B's corners are mapped here and by Eigen to 4 u reach each, differences and products of lengths
    // up to 2 r add their own; all together stay below 2000 u reach r², and the exact predicate's own filter is content
    // too.
    const Vec3d reach =
        2 * magnitude(boundsA) + a_T_b.linear().cwiseAbs() * magnitude(boundsB) + a_T_b.translation().cwiseAbs();
    map.doubt = 0x1p-41 * reach.maxCoeff();
    return map;
}

kernel::MeshView meshView(const TriangleMesh& mesh) {
    return {mesh.positions().doubles(), mesh.indices().data(), mesh.positions().floats()};
}

}  // namespace tessera
