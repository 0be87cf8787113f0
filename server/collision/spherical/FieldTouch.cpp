#include "server/collision/spherical/FieldTouch.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>

#include "server/collision/query/FacesNear.h"
#include "server/collision/query/PairFrame.h"
#include "server/collision/spherical/FieldKernels.h"
#include "server/collision/tree/Kernels.h"
#include "server/collision/tree/TreeStorage.h"

namespace tessera {

namespace {

using kernel::FieldWalk;
using kernel::FieldWalkFrame;
using kernel::FieldWalkSink;

/// As in ../query: some dozen roundings of 2^-24 of the lengths involved; and the field's own (FieldRaster.h,
/// FieldPyramid.cpp).
constexpr double kFieldSlack = 1e-5;
/// Beyond this, cubes of lengths leave float.
constexpr double kMostFieldStretch = 1e9;
/// Of maps that are hardly to be turned round nothing is known in float.
constexpr double kMostCondition = 1e5;

/// Who is walked (W), and in whose field (F) it is looked up.
struct Roles {
    const TriangleTree& walked;
    const SphericalField& field;
    bool walkedIsA;
};

double triangleSize(const TriangleTree& tree) {
    const TreeStorage& s = tree.storage();
    return s.empty() ? 0 : s.radius / s.unit / std::sqrt(static_cast<double>(s.mesh->faceCount()));
}

Roles chooseRoles(const SphericalField& a, const SphericalField& b, const Affine3d& a_T_b) {
    const double stretch = a_T_b.linear().norm() / std::sqrt(3.0);
    if (triangleSize(a.tree()) < stretch * triangleSize(b.tree())) return {a.tree(), b, true};
    return {b.tree(), a, false};
}

/// The map for the kernel; nothing where it does not work in float.
std::optional<FieldWalkFrame> walkFrame(const Roles& roles, const Affine3d& a_T_b) {
    const TreeStorage &w = roles.walked.storage(), &f = roles.field.tree().storage();
    if (!a_T_b.matrix().allFinite() || w.options.volume != VolumeKind::kObb) return std::nullopt;
    Affine3d field_T_walked = a_T_b;
    const double forward = a_T_b.linear().norm();
    const Mat3d inverse = a_T_b.linear().inverse();
    const double condition = forward * inverse.norm();
    if (!(condition <= kMostCondition)) return std::nullopt;
    if (roles.walkedIsA) {
        field_T_walked.linear() = inverse;
        field_T_walked.translation() = -(inverse * a_T_b.translation());
    }
    const Mat3d own = field_T_walked.linear() * (f.unit / w.unit);
    const Vec3d shift = (field_T_walked * w.centre - f.centre) * f.unit;
    const double stretch = own.norm();
    if (!(std::max(stretch, shift.norm()) <= kMostFieldStretch)) return std::nullopt;

    FieldWalkFrame frame{};
    frame.tree = w.view();
    frame.parts = roles.field.views().data();
    frame.partCount = static_cast<unsigned>(roles.field.views().size());
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column)
            frame.linear[3 * row + column] = static_cast<float>(own(row, column));
    for (unsigned part = 0; part < frame.partCount; ++part)
        for (int k = 0; k < 3; ++k)
            frame.translation[part][k] = static_cast<float>(shift[k] - roles.field.offset(part)[k]);
    // The exact test maps B to A in double: what that rounds, in A's lengths, seen in the field's. And the map round,
    // whose rounding grows with its condition.
    const TreeStorage &ta = roles.walkedIsA ? w : f, &tb = roles.walkedIsA ? f : w;
    const double lengthsA = (a_T_b.linear().cwiseAbs() * (tb.centre.cwiseAbs() + Vec3d::Constant(1 / tb.unit)) +
                             a_T_b.translation().cwiseAbs() + ta.centre.cwiseAbs() + Vec3d::Constant(1 / ta.unit))
                                .norm();
    const double toField = (roles.walkedIsA ? inverse.norm() : 1) * f.unit;
    const double inDouble = 1e-15 * (8 + 8 * condition) * lengthsA * toField;
    const double slack = kFieldSlack * (f.radius + stretch * w.radius + shift.norm()) + inDouble;
    if (!(slack <= 0.1)) return std::nullopt;  // of a field of size 1
    frame.slack = static_cast<float>(slack * (1 + 1e-6));
    return frame;
}

/// Candidates, decided eight at a time in double and exactly where that cannot tell.
class FieldSearch {
public:
    FieldSearch(const Roles& roles, const Affine3d& a_T_b, const FieldWalkFrame& frame, bool any, const QueryWork& work,
                const TouchOptions& options)
        : roles_(roles),
          a_T_b_(a_T_b),
          frame_(frame),
          any_(any),
          meshA_(roles.walkedIsA ? roles.walked.mesh() : roles.field.tree().mesh()),
          meshB_(roles.walkedIsA ? roles.field.tree().mesh() : roles.walked.mesh()),
          viewA_(meshView(meshA_)),
          viewB_(meshView(meshB_)),
          map_(pairMap(meshA_.bounds(), meshB_.bounds(), a_T_b)),
          kernels_(kernel::treeKernels(options.instructions)),
          walk_(kernel::fieldKernels(options.instructions).walk) {
        sink_.walked = walkedFaces_.data();
        sink_.met = metFaces_.data();
        sink_.enough = any ? kEnoughForAny : kCapacity - 8;
        sink_.capacity = kCapacity;
        sink_.open = openFaces_.data();
        sink_.openCapacity = kOpen;
        sink_.flush = [](FieldWalkSink&, void* self) { return static_cast<FieldSearch*>(self)->decide(); };
        sink_.context = this;
        sink_.nodeTests = work.boxTests;
        sink_.triangleTests = work.triangleTests;
        sink_.limit = work.limit;
    }
    FieldSearch(const FieldSearch&) = delete;
    FieldSearch& operator=(const FieldSearch&) = delete;

    void run() {
        if (!walk_(frame_, sink_)) decide();
    }
    [[nodiscard]] bool exhausted() const { return sink_.exhausted; }
    [[nodiscard]] std::vector<FacePair>& pairs() { return pairs_; }
    void take(QueryWork& work) const {
        work.boxTests = sink_.nodeTests;
        work.triangleTests = sink_.triangleTests;
    }

private:
    static constexpr std::uint32_t kCapacity = 256, kOpen = 64, kEnoughForAny = 8;

    /// Empties both lists. True: enough is known.
    bool decide() {
        if (decidePairs()) return true;
        if (sink_.openCount == 0) return false;
        const std::uint32_t open = sink_.openCount;
        sink_.openCount = 0;
        for (std::uint32_t i = 0; i < open; ++i)
            if (searchNear(openFaces_[i])) return true;
        return decidePairs();
    }

    bool decidePairs() {
        std::array<std::uint8_t, kCapacity / 8> meeting, open;
        const std::uint32_t* const facesA = roles_.walkedIsA ? walkedFaces_.data() : metFaces_.data();
        const std::uint32_t* const facesB = roles_.walkedIsA ? metFaces_.data() : walkedFaces_.data();
        const std::uint32_t count = sink_.count;
        sink_.count = 0;
        kernels_.decide(viewA_, viewB_, map_, facesA, facesB, count, meeting.data(), open.data());
        for (std::uint32_t group = 0; 8 * group < count; ++group)
            for (unsigned left = meeting[group] | open[group]; left != 0; left &= left - 1) {
                const unsigned bit = static_cast<unsigned>(std::countr_zero(left));
                const FacePair pair{facesA[8 * group + bit], facesB[8 * group + bit]};
                if ((open[group] >> bit & 1U) != 0 &&
                    !trianglesIntersect(meshA_.triangle(pair.a), transformed(a_T_b_, meshB_.triangle(pair.b))))
                    continue;
                pairs_.push_back(pair);
                if (any_) return true;
            }
        return false;
    }

    /// A face that is too large for the field's texels: the other body's tree knows what is near it.
    bool searchNear(std::uint32_t face) {
        const float* const m = frame_.linear;
        const TreeStorage &w = roles_.walked.storage(), &f = roles_.field.tree().storage();
        Box box;
        for (unsigned k = 0; k < 3; ++k) {
            const Vec3d own = (w.mesh->corner(face, k) - w.centre) * w.unit;
            Vec3d p;
            for (int r = 0; r < 3; ++r)
                p[r] = static_cast<double>(m[3 * r]) * own[0] + static_cast<double>(m[3 * r + 1]) * own[1] +
                       static_cast<double>(m[3 * r + 2]) * own[2] + static_cast<double>(frame_.translation[0][r]) +
                       roles_.field.offset(0)[r];
            box.extend(f.centre + p / f.unit);
        }
        const Vec3d slack = Vec3d::Constant(2 * static_cast<double>(frame_.slack) / f.unit);
        box.lower -= slack;
        box.upper += slack;
        near_.clear();
        QueryWork work{sink_.nodeTests, sink_.triangleTests, sink_.limit};
        if (!facesNear(roles_.field.tree(), box, work, near_)) {
            sink_.exhausted = true;
            return true;
        }
        sink_.nodeTests = work.boxTests;
        sink_.triangleTests = work.triangleTests;
        for (const std::uint32_t other : near_) {
            walkedFaces_[sink_.count] = face;
            metFaces_[sink_.count++] = other;
            if (sink_.count == kCapacity - 8 && decidePairs()) return true;
        }
        return false;
    }

    const Roles& roles_;
    const Affine3d& a_T_b_;
    const FieldWalkFrame& frame_;
    bool any_;
    const TriangleMesh &meshA_, &meshB_;
    kernel::MeshView viewA_, viewB_;
    kernel::PairMap map_;
    const kernel::TreeKernels& kernels_;
    FieldWalk walk_;
    std::array<std::uint32_t, kCapacity> walkedFaces_, metFaces_;
    std::array<std::uint32_t, kOpen> openFaces_;
    FieldWalkSink sink_{};
    std::vector<FacePair> pairs_;
    std::vector<std::uint32_t> near_;
};

bool empty(const Roles& roles) {
    return roles.walked.storage().empty() || roles.field.views().empty();
}
const TriangleTree& treeA(const Roles& r) {
    return r.walkedIsA ? r.walked : r.field.tree();
}
const TriangleTree& treeB(const Roles& r) {
    return r.walkedIsA ? r.field.tree() : r.walked;
}

TouchedPair first(const Roles& roles, const Affine3d& a_T_b, QueryWork& work, const TouchOptions& options) {
    if (empty(roles)) return {};
    if (work.exhausted()) return {Touch::kUnknown, {}};
    const std::optional<FieldWalkFrame> frame = walkFrame(roles, a_T_b);
    if (!frame) return firstTouching(treeA(roles), treeB(roles), a_T_b, work, options);
    FieldSearch search(roles, a_T_b, *frame, true, work, options);
    search.run();
    search.take(work);
    if (!search.pairs().empty()) return {Touch::kYes, search.pairs().front()};
    return {search.exhausted() ? Touch::kUnknown : Touch::kNo, {}};
}

FacePairs all(const Roles& roles, const Affine3d& a_T_b, QueryWork& work, const TouchOptions& options) {
    FacePairs out;
    if (empty(roles)) return out;
    if (work.exhausted()) {
        out.complete = false;
        return out;
    }
    const std::optional<FieldWalkFrame> frame = walkFrame(roles, a_T_b);
    if (!frame) return allTouching(treeA(roles), treeB(roles), a_T_b, work, options);
    FieldSearch search(roles, a_T_b, *frame, false, work, options);
    search.run();
    search.take(work);
    out.complete = !search.exhausted();
    out.pairs = std::move(search.pairs());
    // A triangle is listed in every texel that it is seen through.
    std::sort(out.pairs.begin(), out.pairs.end());
    out.pairs.erase(std::unique(out.pairs.begin(), out.pairs.end()), out.pairs.end());
    return out;
}

}  // namespace

TouchedPair firstTouching(const SphericalField& a, const SphericalField& b, const Affine3d& a_T_b, QueryWork& work,
                          const TouchOptions& options) {
    return first(chooseRoles(a, b, a_T_b), a_T_b, work, options);
}
FacePairs allTouching(const SphericalField& a, const SphericalField& b, const Affine3d& a_T_b, QueryWork& work,
                      const TouchOptions& options) {
    return all(chooseRoles(a, b, a_T_b), a_T_b, work, options);
}
TouchedPair firstTouching(const SphericalField& a, const TriangleTree& b, const Affine3d& a_T_b, QueryWork& work,
                          const TouchOptions& options) {
    return first({b, a, false}, a_T_b, work, options);
}
FacePairs allTouching(const SphericalField& a, const TriangleTree& b, const Affine3d& a_T_b, QueryWork& work,
                      const TouchOptions& options) {
    return all({b, a, false}, a_T_b, work, options);
}
TouchedPair firstTouching(const TriangleTree& a, const SphericalField& b, const Affine3d& a_T_b, QueryWork& work,
                          const TouchOptions& options) {
    return first({a, b, true}, a_T_b, work, options);
}
FacePairs allTouching(const TriangleTree& a, const SphericalField& b, const Affine3d& a_T_b, QueryWork& work,
                      const TouchOptions& options) {
    return all({a, b, true}, a_T_b, work, options);
}

}  // namespace tessera
