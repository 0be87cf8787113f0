#include "server/collision/query/TimeOfImpact.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "server/collision/mesh/ElementaryMotion.h"
#include "server/collision/query/BodyWay.h"
#include "server/collision/query/ImpactKernelTable.h"
#include "server/collision/query/ImpactSearch.h"
#include "server/collision/query/SupportSet.h"
#include "server/collision/tree/TreeStorage.h"

namespace tessera {

namespace {

using kernel::ChildRef;
using kernel::kLeafBit;
using kernel::kLeafFaces;
using kernel::kWidth;
using kernel::Slot;
using Item = ImpactSearch::Item;

void set(float (&out)[9], const Mat3d& m) {
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column) out[3 * row + column] = static_cast<float>(m(row, column));
}
void set(float (&out)[3], const Vec3d& v) {
    for (int i = 0; i < 3; ++i) out[i] = static_cast<float>(v[i]);
}
float up(double x) {
    return static_cast<float>(x * (1 + 1e-6));
}

/// A body and all that is the same at any moment of its way.
struct Body {
    const TriangleTree& tree;
    const TreeStorage& storage;
    kernel::TreeView view;
    std::size_t shape;
    BodyWay way;
    double meshReach;  ///< of its points from the mesh's origin, in the model's lengths
    double reach;      ///< of its points from the origin of the frame that moves

    Body(const TriangleTree& t, const BodyMotion& motion)
        : tree(t),
          storage(t.storage()),
          view(storage.view()),
          shape(static_cast<std::size_t>(shapeOf(t.options().volume))),
          way(motion),
          meshReach(storage.centre.norm() + storage.radius / storage.unit),
          reach(way.reachAround(storage.centre, storage.radius / storage.unit)) {}

    /// The size that it has in the shared frame, at most.
    [[nodiscard]] double size() const { return way.stretch() * storage.radius / storage.unit; }
    /// What counts as rounding in the shared frame.
    [[nodiscard]] double rounding() const { return 0x1p-53 * 64 * way.extent(meshReach); }

    [[nodiscard]] kernel::MovingFrame frame(const BodyMoment& m, double t, const Vec3d& origin, const Vec3d& drift,
                                            double unit, bool similarity) const {
        const double factor = unit / storage.unit;
        kernel::MovingFrame f{};
        set(f.linear, m.linear * factor);
        set(f.translation, (m.place(storage.centre) - origin) * unit);
        set(f.turning, m.turning * factor);
        set(f.drift, (m.velocity(storage.centre) - drift) * unit);
        f.scale = 1;
        set(f.axes, m.linear * factor);
        if (similarity) {
            const double scale = std::abs(way.scaleAt(t)) * factor;
            f.scale = static_cast<float>(scale);
            set(f.axes, m.linear * (factor / scale));
        }
        f.stretch = up(way.stretchAt(t) * factor);
        f.growth = up(way.turn() * factor);
        f.swelling = up(way.swelling() * factor);
        set(f.axis, way.axis());
        f.acceleration = up(way.acceleration(reach) * unit);
        return f;
    }
};

/// Both bodies at one moment.
struct Moment {
    double t = -1;
    BodyMoment a, b;
};

class RigidSearch {
public:
    RigidSearch(const Body& a, const Body& b, const ImpactOptions& options, QueryWork& work)
        : a_(a), b_(b), kernels_(kernel::impactKernels()), work_(work), options_(options) {
        const double size = std::max(a.size(), b.size());
        unit_ = size > 0 ? 1 / size : 1;
        margin_ = a.rounding() + b.rounding();
        tolerance_ = options.tolerance > 4 * margin_ ? options.tolerance : 4 * margin_;
        start_ = {0, a.way.at(0), b.way.at(0)};
        if (!options.supports.empty()) supports_.emplace(a.way, a.reach, b.way, b.reach, options.supports, margin_);
    }

    Impact run() {
        search_.push({});
        while (!search_.empty()) {
            const Item item = search_.pop();
            if (work_.exhausted() || steps_ > options_.maxSteps) return {.hit = false, .t = item.t, .complete = false};
            if (item.faces) {
                ++steps_;
                if (touch(item)) return impact(item);
            } else {
                open(item);
            }
        }
        return {};
    }

private:
    void moveTo(double t) {
        if (now_.t == t) return;
        now_.t = t;
        now_.a = a_.way.at(t);
        now_.b = b_.way.at(t);
        framed_ = false;
    }

    const kernel::ImpactFrame& frame() {
        if (framed_) return frame_;
        framed_ = true;
        const Vec3d origin = now_.a.place(a_.storage.centre), drift = now_.a.velocity(a_.storage.centre);
        const auto passesZero = [&](const Body& x) {
            return !(std::abs(x.way.scaleAt(now_.t)) > 1e-6 * x.way.stretch());
        };
        frame_.similarity = a_.way.similarity() && b_.way.similarity() && !passesZero(a_) && !passesZero(b_);
        frame_.a = a_.frame(now_.a, now_.t, origin, drift, unit_, frame_.similarity);
        frame_.b = b_.frame(now_.b, now_.t, origin, drift, unit_, frame_.similarity);
        // A position goes through some dozen roundings of 2^-24 of the lengths involved, its velocity likewise.
        constexpr double kSlack = 4e-6;
        const double away = (now_.b.place(b_.storage.centre) - origin).norm();
        const double passing = (now_.b.velocity(b_.storage.centre) - drift).norm();
        frame_.slack = up(kSlack * unit_ * (away + a_.size() + b_.size()) + 2 * margin_ * unit_);
        frame_.rateSlack = up(kSlack * unit_ * (passing + turnOf(a_) + turnOf(b_)) + 2 * margin_ * unit_);
        frame_.horizon = static_cast<float>(std::clamp(1 - now_.t, 0.0, 0.25));
        return frame_;
    }
    static double turnOf(const Body& x) { return x.way.turn() * x.storage.radius / x.storage.unit; }

    void push(double free, double t, Item item) {
        // Free to the end and beyond.
        if (t + free > 1) return;
        item.t = t + free;
        search_.push(item);
    }

    /// Looks at the two volumes' parts at the moment up to which the whole is free.
    void open(const Item& item) {
        moveTo(item.t);
        const ChildRef refA = a_.view.children[item.a], refB = b_.view.children[item.b];
        if ((refA & refB & kLeafBit) != 0) {
            eachLeafPair(refA, refB, frame(), [&](float free, std::uint32_t a, std::uint32_t b) {
                if (!leftOut({a, b})) push(static_cast<double>(free), item.t, {.a = a, .b = b, .faces = true});
            });
        } else {
            eachPart(item.a, item.b, frame(), [&](float free, Slot a, Slot b) {
                if (supports_ && item.t + static_cast<double>(free) <= 1 && heldAsAWhole(a, b)) return;
                push(static_cast<double>(free), item.t, {.a = a, .b = b, .depth = item.depth + 1});
            });
        }
    }
    [[nodiscard]] bool leftOut(const FacePair& faces) const {
        return !options_.within.empty() && std::ranges::binary_search(options_.within, faces);
    }
    [[nodiscard]] bool heldAsAWhole(Slot a, Slot b) {
        return supports_->holdsToTheEnd(
            [&](const Vec3d& n) { return extentAlong(a_.storage, start_.a, a, n); },
            [&](const Vec3d& n) { return extentAlong(b_.storage, start_.b, b, n); });
    }

    /// found(time free, slot of A, slot of B) for the children of the larger volume with the other.
    template <typename Found>
    void eachPart(Slot slotA, Slot slotB, const kernel::ImpactFrame& f, Found&& found) {
        const ChildRef refA = a_.view.children[slotA], refB = b_.view.children[slotB];
        kernel::PlacedBox boxA, boxB;
        kernels_.place[a_.shape](a_.view, f, f.a, slotA, boxA);
        kernels_.place[b_.shape](b_.view, f, f.b, slotB, boxB);
        const bool intoA = (refB & kLeafBit) != 0 || ((refA & kLeafBit) == 0 && boxA.radius > boxB.radius);
        const Body& opened = intoA ? a_ : b_;
        const ChildRef node = intoA ? refA : refB;
        alignas(64) std::array<float, kWidth> times;
        ++work_.boxTests;
        kernels_.nodeTimes[f.similarity ? 0 : 1][opened.shape](opened.view, intoA ? f.a : f.b, node,
                                                               intoA ? boxB : boxA, f, times.data());
        for (Slot i = 0; i < kWidth; ++i) {
            const Slot slot = node * kWidth + i;
            if (opened.view.children[slot] != kernel::kNoChild)
                found(times[i], intoA ? slot : slotA, intoA ? slotB : slot);
        }
    }

    /// found(time free, face of A, face of B) for all pairs of two leaves.
    template <typename Found>
    void eachLeafPair(ChildRef refA, ChildRef refB, const kernel::ImpactFrame& f, Found&& found) {
        const std::size_t leafA = (refA & ~kLeafBit) >> 2, leafB = (refB & ~kLeafBit) >> 2;
        const unsigned countA = (refA & 3) + 1, countB = (refB & 3) + 1;
        alignas(64) std::array<float, kLeafFaces * kLeafFaces> times;
        kernels_.leafTimes(a_.view.corners + leafA * kernel::kLeafRows * kLeafFaces,
                           b_.view.corners + leafB * kernel::kLeafRows * kLeafFaces, f, times.data());
        work_.triangleTests += countA * countB;
        for (unsigned i = 0; i < countA; ++i)
            for (unsigned j = 0; j < countB; ++j)
                found(times[i * kLeafFaces + j], a_.view.faces[leafA * kLeafFaces + i],
                      b_.view.faces[leafB * kLeafFaces + j]);
    }

    /// One step of conservative advancement of two faces, from the moment up to which they are free. True: they are
    /// within the tolerance there, and nothing holds them.
    bool touch(Item item) {
        moveTo(item.t);
        ++work_.triangleTests;
        const Triangle xa = a_.tree.mesh().triangle(item.a), xb = b_.tree.mesh().triangle(item.b);
        MovingPair pair;
        for (std::size_t i = 0; i < 3; ++i) {
            pair.a[i] = now_.a.place(xa[i]);
            pair.b[i] = now_.b.place(xb[i]);
            pair.velocityA[i] = now_.a.velocity(xa[i]);
            pair.velocityB[i] = now_.b.velocity(xb[i]);
            pair.reachA = std::max(pair.reachA, a_.way.reachOf(xa[i]));
            pair.reachB = std::max(pair.reachB, b_.way.reachOf(xb[i]));
        }
        if (item.depth != 0 && supports_->stays(pair, item.t, item.depth)) {
            const double held = supports_->heldFor(pair, item.t, item.depth);
            push(held, item.t, item);
            return false;
        }
        const NearestPoints near = nearestPoints(pair.a, pair.b);
        Vec3d apart = Vec3d::Zero();
        double free = 0;
        if (near.distance > 0) {
            const Vec3d n = directionApart(pair.a, pair.b, near);
            const double gap = lowest(n, pair.b) + lowest(-n, pair.a) - 2 * margin_;
            // Nearer than that rounding would choose the direction.
            if (gap > -1.75 * margin_) apart = n;
            const double bend = bendAlong(n, a_.way, pair.reachA) + bendAlong(n, b_.way, pair.reachB);
            free = pair.timeApart(n, 2 * margin_, bend);
        }
        const bool passed = item.depth != 0 && supports_->behind(apart, item.t, item.depth);
        // Corners and edges are apart, and yet no direction parts them: one goes through the other. Or they come
        // together within less time than numbers tell, as they do who cross a galaxy in a frame.
        const bool through = !(item.t + free > item.t);
        if (near.distance <= tolerance_ || passed || through) {
            // Near, but parting or passing for good.
            if (item.t + free > 1 && !passed) return false;
            if (!supports_) return true;
            const auto start = [&] { return startOf(xa, xb); };
            const std::uint32_t found = supports_->choose(pair, item.t, apart, item.depth, start);
            if (found == 0) {
                if (item.depth != 0) {
                    expired_ = static_cast<int>(supports_->indexOf(item.depth));
                    metAt_ = supports_->gotDeeperAfter(item.t, item.depth);
                }
                return true;
            }
            item.depth = found;
            push(supports_->heldFor(pair, item.t, found), item.t, item);
            return false;
        }
        item.depth = 0;
        push(free, item.t, item);
        return false;
    }
    [[nodiscard]] std::pair<Triangle, Triangle> startOf(const Triangle& xa, const Triangle& xb) const {
        std::pair<Triangle, Triangle> out;
        for (std::size_t i = 0; i < 3; ++i) {
            out.first[i] = start_.a.place(xa[i]);
            out.second[i] = start_.b.place(xb[i]);
        }
        return out;
    }

    /// Where the faces that were reached first are; and the nearest of all, which may be others.
    Impact impact(const Item& item) {
        const double t = std::min(item.t, metAt_);
        moveTo(t);
        best_ = {};
        offer(item.a, item.b);
        if (!supports_) findNearest();
        Impact out;
        out.hit = true;
        out.t = t;
        out.complete = !work_.exhausted();
        out.support = expired_;
        out.distance = best_.near.distance;
        out.faces = best_.faces;
        const auto [a, b] = placed(best_.faces.a, best_.faces.b);
        if (best_.near.distance > 0) {
            out.point = 0.5 * (best_.near.onA + best_.near.onB);
            out.normal = (best_.near.onB - best_.near.onA) / best_.near.distance;
        } else {
            const TriangleContact contact = contactOf(a, b);
            out.point = contact.point;
            out.normal = contact.normal;
        }
        return out;
    }

    [[nodiscard]] std::pair<Triangle, Triangle> placed(std::uint32_t faceA, std::uint32_t faceB) const {
        std::pair<Triangle, Triangle> out{a_.tree.mesh().triangle(faceA), b_.tree.mesh().triangle(faceB)};
        for (std::size_t i = 0; i < 3; ++i) {
            out.first[i] = now_.a.place(out.first[i]);
            out.second[i] = now_.b.place(out.second[i]);
        }
        return out;
    }

    void offer(std::uint32_t faceA, std::uint32_t faceB) {
        ++work_.triangleTests;
        const auto [a, b] = placed(faceA, faceB);
        NearestPoints near = nearestPoints(a, b);
        if (trianglesIntersect(a, b)) near.distance = 0;
        const FacePair faces{faceA, faceB};
        if (near.distance < best_.near.distance || (near.distance == best_.near.distance && faces < best_.faces))
            best_ = {near, faces};
    }

    /// Branch and bound at this moment. Bodies that stand still, but for an acceleration of 2 towards each other, are
    /// apart for the square root of their gap.
    void findNearest() {
        kernel::ImpactFrame still = frame();
        for (kernel::MovingFrame* f : {&still.a, &still.b}) {
            std::fill(std::begin(f->turning), std::end(f->turning), 0.0f);
            std::fill(std::begin(f->drift), std::end(f->drift), 0.0f);
            f->growth = f->swelling = f->acceleration = 0;
        }
        still.rest = 2;
        still.rateSlack = 0;
        still.horizon = 1;
        struct Task {
            Slot a, b;
        };
        std::vector<Task> tasks{{0, 0}};
        const auto farther = [&](float time) {
            const double root = static_cast<double>(time);
            return root * root > best_.near.distance * unit_;
        };
        while (!tasks.empty() && best_.near.distance > 0 && !work_.exhausted()) {
            const Task task = tasks.back();
            tasks.pop_back();
            const ChildRef refA = a_.view.children[task.a], refB = b_.view.children[task.b];
            if ((refA & refB & kLeafBit) != 0) {
                eachLeafPair(refA, refB, still, [&](float time, std::uint32_t a, std::uint32_t b) {
                    if (!farther(time)) offer(a, b);
                });
            } else {
                eachPart(task.a, task.b, still, [&](float time, Slot a, Slot b) {
                    if (!farther(time)) tasks.push_back({a, b});
                });
            }
        }
    }

    const Body &a_, &b_;
    const kernel::ImpactKernels& kernels_;
    QueryWork& work_;
    const ImpactOptions& options_;
    std::uint64_t steps_ = 0;
    double tolerance_ = 0, unit_ = 1, margin_ = 0;
    ImpactSearch search_;
    std::optional<SupportSet> supports_;
    int expired_ = -1;
    double metAt_ = 1;
    struct Nearest {
        NearestPoints near{Vec3d::Zero(), Vec3d::Zero(), std::numeric_limits<double>::infinity()};
        FacePair faces;
    };
    Nearest best_;
    Moment now_, start_;
    bool framed_ = false;
    kernel::ImpactFrame frame_{};
};

}  // namespace

Impact timeOfImpact(const TriangleTree& a, const BodyMotion& motionA, const TriangleTree& b, const BodyMotion& motionB,
                    QueryWork& work, const ImpactOptions& options) {
    if (a.storage().empty() || b.storage().empty()) return {};
    const Body bodyA(a, motionA), bodyB(b, motionB);
    if (!bodyA.way.valid() || !bodyB.way.valid()) return {.t = 0, .complete = false};
    return RigidSearch(bodyA, bodyB, options, work).run();
}

}  // namespace tessera
