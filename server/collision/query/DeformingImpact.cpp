// The time of impact of bodies whose vertices all go straight. What bounds a part of a body is a box at the start and
// one at the end: every moment's vertices are within the box between the two.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "common/math/Box.h"
#include "server/collision/mesh/ElementaryMotion.h"
#include "server/collision/mesh/Predicates.h"
#include "server/collision/query/ImpactKernelTable.h"
#include "server/collision/query/ImpactSearch.h"
#include "server/collision/query/StraightLeaf.h"
#include "server/collision/query/TimeOfImpact.h"
#include "server/collision/tree/TreeStorage.h"

namespace tessera {
namespace {

using kernel::ChildRef;
using kernel::kLeafBit;
using kernel::kLeafFaces;
using kernel::kWidth;
using kernel::Slot;
using Item = ImpactSearch::Item;

struct MovingBox {
    Box start, end;

    void extend(const MovingBox& other) {
        start.extend(other.start);
        end.extend(other.end);
    }
    [[nodiscard]] double size() const { return start.size().sum() + end.size().sum(); }
    [[nodiscard]] Box at(double t) const {
        Box out;
        out.lower = (1 - t) * start.lower + t * end.lower;
        out.upper = (1 - t) * start.upper + t * end.upper;
        return out;
    }
};

/// The tree's division with boxes around what its parts are now and will be.
class DeformingBody {
public:
    DeformingBody(const TriangleTree& tree, std::span<const Vec3d> end)
        : mesh_(tree.mesh()), storage_(tree.storage()), end_(end) {
        valid_ = end.size() == mesh_.vertexCount();
        if (!valid_) return;
        for (const Vec3d& p : end) {
            const double size = p.cwiseAbs().maxCoeff();
            valid_ = valid_ && p.allFinite() && size <= TriangleMeshLimits{}.maxCoordinate;
            largest_ = std::max(largest_, size);
        }
        for (const Vec3d& p : mesh_.positions()) largest_ = std::max(largest_, p.cwiseAbs().maxCoeff());
        if (!valid_ || storage_.empty()) return;
        boxes_.resize(storage_.children.size());
        fit(0);
    }

    /// One end position per vertex, all finite and within a mesh's limits.
    [[nodiscard]] bool valid() const { return valid_; }
    /// No coordinate is larger on the way.
    [[nodiscard]] double largest() const { return largest_; }
    [[nodiscard]] ChildRef child(Slot slot) const { return storage_.children[slot]; }
    [[nodiscard]] std::size_t leafCount() const { return storage_.leafCount(); }
    [[nodiscard]] const MovingBox& box(Slot slot) const { return boxes_[slot]; }
    [[nodiscard]] Triangle start(std::uint32_t face) const { return mesh_.triangle(face); }
    [[nodiscard]] Triangle end(std::uint32_t face) const {
        return {end_[mesh_.vertexOf(face, 0)], end_[mesh_.vertexOf(face, 1)], end_[mesh_.vertexOf(face, 2)]};
    }
    [[nodiscard]] Triangle at(std::uint32_t face, double t) const {
        const Triangle from = start(face), to = end(face);
        Triangle out;
        for (std::size_t i = 0; i < 3; ++i) out[i] = (1 - t) * from[i] + t * to[i];
        return out;
    }
    [[nodiscard]] MovingBox boxOf(std::uint32_t face) const {
        MovingBox box;
        for (const Vec3d& p : start(face)) box.start.extend(p);
        for (const Vec3d& p : end(face)) box.end.extend(p);
        return box;
    }
    [[nodiscard]] std::span<const std::uint32_t> faces(ChildRef leaf) const {
        return std::span(storage_.leafFaces).subspan(((leaf & ~kLeafBit) >> 2) * kLeafFaces, (leaf & 3) + 1);
    }

    /// A leaf's triangles as they begin and as they end.
    void gather(ChildRef leaf, kernel::StraightLeaf& out) const {
        gather(
            leaf, [&](std::uint32_t face) { return start(face); }, out.start);
        gather(
            leaf, [&](std::uint32_t face) { return end(face); }, out.end);
    }
    /// As they are at a moment, for what looks at the start alone.
    void gatherAt(ChildRef leaf, double t, kernel::StraightLeaf& out) const {
        gather(
            leaf, [&](std::uint32_t face) { return at(face, t); }, out.start);
    }

private:
    template <typename Placed>
    void gather(ChildRef leaf, const Placed& placed, double* rows) const {
        const std::span<const std::uint32_t> all = faces(leaf);
        for (std::size_t i = 0; i < kLeafFaces; ++i) setTriangle(rows, i, placed(all[i < all.size() ? i : 0]));
    }
    MovingBox fit(std::size_t node) {
        MovingBox all;
        for (std::size_t slot = node * kWidth; slot < (node + 1) * kWidth; ++slot) {
            const ChildRef ref = storage_.children[slot];
            if (ref == kernel::kNoChild) continue;
            if ((ref & kLeafBit) != 0)
                for (const std::uint32_t face : faces(ref)) boxes_[slot].extend(boxOf(face));
            else
                boxes_[slot] = fit(ref);
            all.extend(boxes_[slot]);
        }
        return all;
    }

    const TriangleMesh& mesh_;
    const TreeStorage& storage_;
    std::span<const Vec3d> end_;
    std::vector<MovingBox> boxes_;  ///< per slot
    double largest_ = 0;
    bool valid_ = false;
};

constexpr double kNever = 2;

/// Two boxes are apart before `t`. Until when are they for certain, by one axis after the other? kNever: to the end.
/// A gap runs linearly from g0 to g1 as long as it is one; quotients are rounded towards what is safe.
double freeUntil(const MovingBox& a, const MovingBox& b, double margin, double t) {
    constexpr double kOutwards = 8 * exact::kRounding;
    std::array<double, 6> g0, g1;
    for (int k = 0; k < 3; ++k) {
        const auto i = static_cast<std::size_t>(k);
        g0[i] = b.start.lower[k] - a.start.upper[k] - margin;
        g1[i] = b.end.lower[k] - a.end.upper[k] - margin;
        g0[i + 3] = a.start.lower[k] - b.start.upper[k] - margin;
        g1[i + 3] = a.end.lower[k] - b.end.upper[k] - margin;
    }
    for (bool further = true; further;) {
        further = false;
        for (std::size_t i = 0; i < 6; ++i) {
            if (g0[i] > 0 && g1[i] > 0) return kNever;
            if (g0[i] > 0) {
                const double until = g0[i] / (g0[i] - g1[i]) * (1 - kOutwards);
                further = further || until > t;
                t = std::max(t, until);
            } else if (g1[i] > 0 && t >= g0[i] / (g0[i] - g1[i]) * (1 + kOutwards)) {
                return kNever;
            }
        }
    }
    return t;
}

double gapBetween(const Box& a, const Box& b) {
    return (b.lower - a.upper).cwiseMax(a.lower - b.upper).cwiseMax(0.0).norm();
}

class DeformingSearch {
public:
    DeformingSearch(const DeformingBody& a, const DeformingBody& b, double tolerance, QueryWork& work)
        : a_(a), b_(b), work_(work), leavesA_(a.leafCount()), leavesB_(b.leafCount()), planes_(b.leafCount()) {
        // Of every coordinate of a corner between its ends, wherever that is computed.
        slack_ = 16 * exact::kRounding * (a.largest() + b.largest());
        tolerance_ = tolerance > 8 * slack_ ? tolerance : 8 * slack_;
        margin_ = (tolerance_ + 64 * slack_) * (1 + 1e-9);
    }

    Impact run() {
        if (const std::optional<Impact> atStart = touchingAtStart()) return *atStart;
        push(a_.box(0), b_.box(0), {});
        while (!search_.empty()) {
            const Item item = search_.pop();
            if (item.depth == kDecided) return impact(item);
            if (work_.exhausted()) return {.t = item.t, .complete = false};
            if (!item.faces)
                open(item);
            else if (!advance(item))
                return {.t = item.t, .complete = false};
        }
        return {};
    }

private:
    static constexpr std::uint32_t kDecided = 0xffffffffu;

    /// What meets as it begins is found in the order of the whole search, but without following those faces that
    /// certainly are apart then: most of those whose boxes meet. Nothing where none meets, or the whole search has to
    /// tell.
    std::optional<Impact> touchingAtStart() {
        constexpr std::uint64_t kPlenty = 1u << 22;
        if (work_.boxTests + work_.triangleTests + kPlenty > work_.limit) return std::nullopt;
        const QueryWork before = work_;
        startOnly_ = true;
        push(a_.box(0), b_.box(0), {});
        std::optional<Impact> found;
        while (!search_.empty() && !found) {
            const Item item = search_.pop();
            if (work_.boxTests + work_.triangleTests > before.boxTests + before.triangleTests + kPlenty / 2) break;
            if (!item.faces) {
                open(item);
                continue;
            }
            const Triangle a = a_.start(item.a), b = b_.start(item.b);
            ++work_.triangleTests;
            if (trianglesIntersect(a, b)) {
                found = impact(item);
            } else if (nearestPoints(a, b).distance <= tolerance_ && hitsAtStart(item, 1)) {
                // Whether that counts may depend on what else is known by then.
                if (!hitsAtStart(item, std::numeric_limits<double>::denorm_min())) break;
                found = impact(item);
            }
        }
        startOnly_ = false;
        search_ = {};
        if (!found) work_ = before;
        return found;
    }

    [[nodiscard]] bool hitsAtStart(const Item& item, double upTo) const {
        return trianglesImpact(a_.start(item.a), a_.end(item.a), b_.start(item.b), b_.end(item.b),
                               {.tolerance = tolerance_, .slack = slack_, .upTo = upTo, .mostSteps = 1u << 20})
            .hit;
    }

    /// A part of A lies on one side of the planes that the faces of a leaf of B are in as they begin, farther off than
    /// the tolerance, all along (or only looked at then). So none of its faces ever hits one of those.
    [[nodiscard]] bool besidePlanes(const MovingBox& part, ChildRef leafB) {
        kernel::StraightBox box;
        for (int i = 0; i < 3; ++i) {
            double *const centre = box.centre[i], *const half = box.half[i];
            centre[0] = 0.5 * (part.start.lower[i] + part.start.upper[i]);
            centre[1] = 0.5 * (part.end.lower[i] + part.end.upper[i]);
            half[0] = 0.5 * (part.start.upper[i] - part.start.lower[i]);
            half[1] = 0.5 * (part.end.upper[i] - part.end.lower[i]);
        }
        return kernels_.besidePlanes(planesOf(leafB), box, !startOnly_);
    }

    const kernel::LeafPlanes& planesOf(ChildRef leafB) {
        return planes_.of(leafB, [&](kernel::LeafPlanes& out) {
            const std::span<const std::uint32_t> faces = b_.faces(leafB);
            for (std::size_t i = 0; i < kLeafFaces; ++i) {
                const std::uint32_t face = faces[i < faces.size() ? i : 0];
                setPlane(out, i, b_.start(face), b_.end(face), margin_);
            }
        });
    }

    /// Nothing later than this is looked at.
    [[nodiscard]] double latest() const { return startOnly_ ? 0 : std::min(1.0, earliest_); }

    void push(const MovingBox& a, const MovingBox& b, Item item) {
        item.t = freeUntil(a, b, 2 * slack_, item.t);
        if (item.t <= latest()) search_.push(item);
    }

    void open(const Item& item) {
        const ChildRef refA = a_.child(item.a), refB = b_.child(item.b);
        if ((refA & refB & kLeafBit) != 0) {
            // Those that are apart all along never hit.
            eachMeeting(refA, refB, [&](std::uint32_t faceA, std::uint32_t faceB) {
                Item pair{.t = item.t, .a = faceA, .b = faceB, .faces = true};
                pair.t = freeUntil(a_.boxOf(faceA), b_.boxOf(faceB), 2 * slack_, pair.t);
                if (pair.t <= latest()) search_.push(pair);
            });
            return;
        }
        eachPart(item.a, item.b, [&](Slot slotA, Slot slotB) {
            const double t = freeUntil(a_.box(slotA), b_.box(slotB), 2 * slack_, item.t);
            if (t > latest()) return;
            const ChildRef partB = b_.child(slotB);
            if ((partB & kLeafBit) != 0 && besidePlanes(a_.box(slotA), partB)) return;
            search_.push({.t = t, .a = slotA, .b = slotB, .depth = item.depth + 1});
        });
    }

    /// found(face of A, face of B) for the pairs of two leaves that no direction shows apart all along (or as they
    /// begin, where only that is looked at).
    template <typename Found>
    void eachMeeting(ChildRef refA, ChildRef refB, Found&& found) {
        const kernel::StraightLeaf& a = leavesA_.of(refA, [&](kernel::StraightLeaf& out) { a_.gather(refA, out); });
        const kernel::StraightLeaf& b = leavesB_.of(refB, [&](kernel::StraightLeaf& out) { b_.gather(refB, out); });
        work_.triangleTests += a_.faces(refA).size() * b_.faces(refB).size();
        eachPair(refA, refB, (startOnly_ ? kernels_.meetingAtStart : kernels_.meetingOnTheWay)(a, b, margin_), found);
    }
    template <typename Found>
    void eachPair(ChildRef refA, ChildRef refB, std::uint32_t bits, Found&& found) {
        const auto facesA = a_.faces(refA), facesB = b_.faces(refB);
        for (std::size_t i = 0; i < facesA.size(); ++i)
            for (std::size_t j = 0; j < facesB.size(); ++j)
                if ((bits >> (kLeafFaces * i + j) & 1u) != 0) found(facesA[i], facesB[j]);
    }

    /// The children of the larger of two with the other.
    template <typename Found>
    void eachPart(Slot slotA, Slot slotB, Found&& found) {
        const ChildRef refA = a_.child(slotA), refB = b_.child(slotB);
        const bool intoA =
            (refB & kLeafBit) != 0 || ((refA & kLeafBit) == 0 && a_.box(slotA).size() > b_.box(slotB).size());
        const DeformingBody& opened = intoA ? a_ : b_;
        const Slot first = (intoA ? refA : refB) * kWidth;
        ++work_.boxTests;
        for (Slot slot = first; slot < first + kWidth; ++slot)
            if (opened.child(slot) != kernel::kNoChild) found(intoA ? slot : slotA, intoA ? slotB : slot);
    }

    /// When two faces meet, if they do before anything known. False where the work ran out.
    bool advance(const Item& item) {
        const std::uint64_t left = work_.limit - (work_.boxTests + work_.triangleTests);
        const ElementaryOptions options{
            .tolerance = tolerance_,
            .slack = slack_,
            .upTo = std::min(1.0, earliest_),
            .mostSteps = static_cast<std::uint32_t>(std::min<std::uint64_t>(left, 1u << 20))};
        const ElementaryImpact found =
            trianglesImpact(a_.start(item.a), a_.end(item.a), b_.start(item.b), b_.end(item.b), options);
        work_.triangleTests += found.steps;
        if (!found.complete) return false;
        if (!found.hit) return true;
        Item decided = item;
        decided.t = found.t;
        decided.depth = kDecided;
        earliest_ = std::min(earliest_, found.t);
        search_.push(decided);
        return true;
    }

    /// Of the pair that is reached first and all others at that moment the nearest.
    Impact impact(const Item& item) {
        struct Task {
            Slot a, b;
        };
        double least = std::numeric_limits<double>::infinity();
        Impact out;
        NearestPoints nearest;
        const auto offer = [&](std::uint32_t faceA, std::uint32_t faceB) {
            ++work_.triangleTests;
            const Triangle a = a_.at(faceA, item.t), b = b_.at(faceB, item.t);
            NearestPoints near = nearestPoints(a, b);
            if (trianglesIntersect(a, b)) near.distance = 0;
            const FacePair faces{faceA, faceB};
            if (near.distance > least || (near.distance == least && !(faces < out.faces))) return;
            least = near.distance;
            nearest = near;
            out.faces = faces;
        };
        offer(item.a, item.b);
        std::vector<Task> tasks{{0, 0}};
        while (!tasks.empty() && least > 0 && !work_.exhausted()) {
            const Task task = tasks.back();
            tasks.pop_back();
            if (gapBetween(a_.box(task.a).at(item.t), b_.box(task.b).at(item.t)) > least + 2 * slack_) continue;
            const ChildRef refA = a_.child(task.a), refB = b_.child(task.b);
            if ((refA & refB & kLeafBit) == 0) {
                eachPart(task.a, task.b, [&](Slot a, Slot b) { tasks.push_back({a, b}); });
                continue;
            }
            kernel::StraightLeaf a, b;
            a_.gatherAt(refA, item.t, a);
            b_.gatherAt(refB, item.t, b);
            // Where faces are long, boxes meet of which no two are near.
            eachPair(refA, refB, kernels_.meetingAtStart(a, b, (least + 64 * slack_) * (1 + 1e-9)), offer);
        }
        out.hit = true;
        out.t = item.t;
        out.distance = least;
        out.complete = least == 0 || !work_.exhausted();
        if (least > 0) {
            out.point = 0.5 * (nearest.onA + nearest.onB);
            out.normal = (nearest.onB - nearest.onA) / least;
        } else {
            const TriangleContact contact = contactOf(a_.at(out.faces.a, item.t), b_.at(out.faces.b, item.t));
            out.point = contact.point;
            out.normal = contact.normal;
        }
        return out;
    }

    const DeformingBody &a_, &b_;
    const kernel::ImpactKernels& kernels_ = kernel::impactKernels();
    QueryWork& work_;
    double slack_ = 0, tolerance_ = 0;
    double margin_ = 0;       ///< of a gap along a direction that shows two faces apart
    bool startOnly_ = false;  ///< what is apart then is not looked at
    PerLeaf<kernel::StraightLeaf> leavesA_, leavesB_;
    PerLeaf<kernel::LeafPlanes> planes_;  ///< of B
    double earliest_ = kNever;            ///< of the pairs that have been decided
    ImpactSearch search_;
};

}  // namespace

Impact timeOfImpact(const TriangleTree& a, std::span<const Vec3d> endA, const TriangleTree& b,
                    std::span<const Vec3d> endB, QueryWork& work, const ImpactOptions& options) {
    const DeformingBody bodyA(a, endA), bodyB(b, endB);
    if (!bodyA.valid() || !bodyB.valid()) return {.t = 0, .complete = false};
    if (a.storage().empty() || b.storage().empty()) return {};
    return DeformingSearch(bodyA, bodyB, options.tolerance, work).run();
}

}  // namespace tessera
