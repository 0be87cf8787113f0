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
#include "server/collision/query/ImpactSearch.h"
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

private:
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
        : a_(a), b_(b), work_(work) {
        // Of every coordinate of a corner between its ends, wherever that is computed.
        slack_ = 16 * exact::kRounding * (a.largest() + b.largest());
        tolerance_ = tolerance > 8 * slack_ ? tolerance : 8 * slack_;
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

    /// What meets as it begins is found in the order of the whole search, but without following those faces that certainly
    /// are apart then: most of those whose boxes meet. Nothing where none meets, or the whole search has to tell.
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

    /// On which side of A, along a direction, B lies farther off than the tolerance and whatever rounding leaves open;
    /// 0: on none.
    [[nodiscard]] int sideAlong(const Vec3d& n, double wide, const Triangle& a, const Triangle& b) const {
        const double a1 = n.dot(a[1] - a[0]), a2 = n.dot(a[2] - a[0]);
        const double b0 = n.dot(b[0] - a[0]), b1 = n.dot(b[1] - a[0]), b2 = n.dot(b[2] - a[0]);
        if (std::min({b0, b1, b2}) - std::max({0.0, a1, a2}) > wide) return 1;
        return std::min({0.0, a1, a2}) - std::max({b0, b1, b2}) > wide ? -1 : 0;
    }

    /// A part of A lies on one side of the plane that a face of B is in as it begins, farther off than the tolerance, all
    /// along (or only looked at then). So none of its faces ever hits that one.
    [[nodiscard]] bool besidePlane(const MovingBox& part, std::uint32_t face) const {
        const Triangle b = b_.start(face), end = startOnly_ ? b : b_.end(face);
        const Vec3d n = (b[1] - b[0]).cross(b[2] - b[0]), size = n.cwiseAbs();
        const double margin = (tolerance_ + 64 * slack_) * (1 + 1e-9) * n.norm();
        const auto side = [&](const Box& box, const Triangle& t) {
            const double middle = n.dot(0.5 * (box.lower + box.upper) - t[0]), half = 0.5 * size.dot(box.upper - box.lower) + margin;
            const double p = n.dot(t[1] - t[0]), q = n.dot(t[2] - t[0]);
            return middle - half > std::max({0.0, p, q}) ? 1 : middle + half < std::min({0.0, p, q}) ? -1 : 0;
        };
        const int before = side(part.start, b);
        return before != 0 && (startOnly_ || side(part.end, end) == before);
    }

    /// Some direction that is square to a face or to two edges at the start shows the two apart then; `throughout`: to the
    /// end too, for between two gaps along one direction that gap is never less than the smaller one.
    [[nodiscard]] bool apart(const Item& item, bool throughout) const {
        const Triangle a = a_.start(item.a), b = b_.start(item.b);
        const Triangle aEnd = throughout ? a_.end(item.a) : a, bEnd = throughout ? b_.end(item.b) : b;
        const double margin = (tolerance_ + 64 * slack_) * (1 + 1e-9);
        const auto shows = [&](const Vec3d& n) {
            const double wide = margin * n.norm();
            const int side = sideAlong(n, wide, a, b);
            return side != 0 && (!throughout || sideAlong(n, wide, aEnd, bEnd) == side);
        };
        const std::array<Vec3d, 3> alongA{a[1] - a[0], a[2] - a[1], a[0] - a[2]}, alongB{b[1] - b[0], b[2] - b[1], b[0] - b[2]};
        if (shows(alongA[0].cross(alongA[1])) || shows(alongB[0].cross(alongB[1]))) return true;
        for (const Vec3d& x : alongA)
            for (const Vec3d& y : alongB)
                if (shows(x.cross(y))) return true;
        return false;
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
            for (const std::uint32_t faceB : b_.faces(refB)) {
                if (besidePlane(a_.box(item.a), faceB)) continue;
                for (const std::uint32_t faceA : a_.faces(refA)) {
                    ++work_.triangleTests;
                    Item pair{.t = item.t, .a = faceA, .b = faceB, .faces = true};
                    pair.t = freeUntil(a_.boxOf(faceA), b_.boxOf(faceB), 2 * slack_, pair.t);
                    // Those that are apart all along never hit.
                    if (pair.t <= latest() && !apart(pair, !startOnly_)) search_.push(pair);
                }
            }
            return;
        }
        eachPart(item.a, item.b, [&](Slot slotA, Slot slotB) {
            const ChildRef partB = b_.child(slotB);
            if ((partB & kLeafBit) != 0 &&
                std::ranges::all_of(b_.faces(partB), [&](std::uint32_t face) { return besidePlane(a_.box(slotA), face); }))
                return;
            push(a_.box(slotA), b_.box(slotB), {.t = item.t, .a = slotA, .b = slotB, .depth = item.depth + 1});
        });
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
            for (const std::uint32_t faceA : a_.faces(refA))
                for (const std::uint32_t faceB : b_.faces(refB))
                    if (gapBetween(a_.boxOf(faceA).at(item.t), b_.boxOf(faceB).at(item.t)) <= least + 2 * slack_)
                        offer(faceA, faceB);
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
    QueryWork& work_;
    double slack_ = 0, tolerance_ = 0;
    bool startOnly_ = false;    ///< what is apart then is not looked at
    double earliest_ = kNever;  ///< of the pairs that have been decided
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
