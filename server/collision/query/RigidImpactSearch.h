/// Conservative advancement of two bodies that move as BodyWay says: the search behind timeOfImpact (TimeOfImpact.h),
/// for whatever has volumes for its parts and triangles for its faces. For the queries of this library.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "server/collision/mesh/ElementaryMotion.h"
#include "server/collision/query/ImpactBody.h"
#include "server/collision/query/ImpactKernelTable.h"
#include "server/collision/query/ImpactSearch.h"
#include "server/collision/query/SupportSet.h"

namespace tessera {

/// Bodies are as TreeImpactBody: part 0 is the whole.
template <typename BodyA, typename BodyB>
class RigidImpactSearch {
    using Item = ImpactSearch::Item;
    using Part = std::uint32_t;
    /// Of two boxes, by their cost.
    static constexpr std::uint64_t kTestsOfAStep = 100;

public:
    RigidImpactSearch(const BodyA& a, const BodyB& b, const ImpactOptions& options, QueryWork& work)
        : a_(a), b_(b), kernels_(kernel::impactKernels()), work_(work), options_(options), thickness_(options) {
        const double thickest = std::max(thickness_.at(0), thickness_.at(1));
        const double size = std::max({a.size(), b.size(), thickest});
        unit_ = size > 0 ? 1 / size : 1;
        margin_ = a.rounding() + b.rounding() + 0x1p-53 * 64 * thickest;
        tolerance_ = options.tolerance > 4 * margin_ ? options.tolerance : 4 * margin_;
        start_ = {0, a.way.at(0), b.way.at(0)};
        if (!options.supports.empty())
            supports_.emplace(a.way, a.reach, b.way, b.reach, options.supports, margin_, thickness_);
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
        const Vec3d origin = now_.a.place(a_.centre), drift = now_.a.velocity(a_.centre);
        const auto passesZero = [&](const ImpactBody& x) {
            return !(std::abs(x.way.scaleAt(now_.t)) > 1e-6 * x.way.stretch());
        };
        frame_.similarity = a_.way.similarity() && b_.way.similarity() && !passesZero(a_) && !passesZero(b_);
        frame_.a = a_.frame(now_.a, now_.t, origin, drift, unit_, frame_.similarity);
        frame_.b = b_.frame(now_.b, now_.t, origin, drift, unit_, frame_.similarity);
        // A position goes through some dozen roundings of 2^-24 of the lengths involved, its velocity likewise.
        constexpr double kSlack = 4e-6;
        const double away = (now_.b.place(b_.centre) - origin).norm();
        const double passing = (now_.b.velocity(b_.centre) - drift).norm();
        const double thick = thickness_.at(now_.t), thickening = thickness_.growth();
        frame_.slack = roundedUp6(kSlack * unit_ * (away + a_.size() + b_.size() + thick) + 2 * margin_ * unit_);
        frame_.rateSlack =
            roundedUp6(kSlack * unit_ * (passing + a_.turn() + b_.turn() + std::abs(thickening)) + 2 * margin_ * unit_);
        frame_.rest = roundedUp6(unit_ * (a_.anyAcceleration() + b_.anyAcceleration()));
        frame_.thickness = static_cast<float>(thick * unit_);
        frame_.thickening = static_cast<float>(thickening * unit_);
        frame_.horizon = static_cast<float>(std::clamp(1 - now_.t, 0.0, 0.25));
        return frame_;
    }

    void push(double free, double t, Item item) {
        // Free to the end and beyond.
        if (t + free > 1) return;
        item.t = t + free;
        search_.push(item);
    }

    /// Looks at the two volumes' parts at the moment up to which the whole is free.
    void open(const Item& item) {
        moveTo(item.t);
        if (a_.isLeaf(item.a) && b_.isLeaf(item.b)) {
            eachLeafPair(item.a, item.b, frame(), [&](float free, std::uint32_t a, std::uint32_t b) {
                if (!leftOut({a, b})) push(static_cast<double>(free), item.t, {.a = a, .b = b, .faces = true});
            });
        } else {
            eachPart(item.a, item.b, frame(), [&](float free, Part a, Part b) {
                if (supports_ && item.t + static_cast<double>(free) <= 1 && heldAsAWhole(a, b)) return;
                push(static_cast<double>(free), item.t, {.a = a, .b = b, .depth = item.depth + 1});
            });
        }
    }
    [[nodiscard]] bool leftOut(const FacePair& faces) const {
        return !options_.within.empty() && std::ranges::binary_search(options_.within, faces);
    }
    [[nodiscard]] bool heldAsAWhole(Part a, Part b) {
        return supports_->holdsToTheEnd([&](const Vec3d& n) { return a_.extentAlong(start_.a, a, n); },
                                        [&](const Vec3d& n) { return b_.extentAlong(start_.b, b, n); });
    }

    /// found(time free, part of A, part of B) for the parts of the larger volume with the other.
    template <typename Found>
    void eachPart(Part partA, Part partB, const kernel::ImpactFrame& f, Found&& found) {
        kernel::PlacedBox boxA, boxB;
        a_.place(kernels_, f, f.a, partA, boxA);
        b_.place(kernels_, f, f.b, partB, boxB);
        ++work_.boxTests;
        if (b_.isLeaf(partB) || (!a_.isLeaf(partA) && boxA.radius > boxB.radius))
            a_.eachPart(kernels_, f, f.a, partA, boxB, [&](float free, Part part) { found(free, part, partB); });
        else
            b_.eachPart(kernels_, f, f.b, partB, boxA, [&](float free, Part part) { found(free, partA, part); });
    }

    /// found(time free, face of A, face of B) for all pairs of two leaves.
    template <typename Found>
    void eachLeafPair(Part partA, Part partB, const kernel::ImpactFrame& f, Found&& found) {
        const auto leafA = a_.leaf(partA);
        const auto leafB = b_.leaf(partB);
        alignas(64) float times[kernel::kLeafFaces * kernel::kLeafFaces];
        kernels_.leafTimes(leafA.corners, leafB.corners, f, times);
        work_.triangleTests += leafA.count * leafB.count;
        for (unsigned i = 0; i < leafA.count; ++i)
            for (unsigned j = 0; j < leafB.count; ++j)
                found(times[i * kernel::kLeafFaces + j], leafA.faces[i], leafB.faces[j]);
    }

    /// One step of conservative advancement of two faces, from the moment up to which they are free. True: they are
    /// within the tolerance there, and nothing holds them.
    bool touch(Item item) {
        moveTo(item.t);
        work_.triangleTests += kTestsOfAStep;
        const Triangle xa = a_.triangle(item.a), xb = b_.triangle(item.b);
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
            const double bend = a_.way.accelerationAlong(n, pair.reachA) + b_.way.accelerationAlong(n, pair.reachB);
            free = pair.timeApart(n, 2 * margin_ + thickness_.at(item.t), 2 * margin_ + thickness_.growth(), bend);
        }
        const bool passed = item.depth != 0 && supports_->behind(apart, item.t, item.depth);
        // Corners and edges are apart, and yet no direction parts them: one goes through the other. Or they come
        // together within less time than numbers tell, as they do who cross a galaxy in a frame.
        const bool through = !(item.t + free > item.t);
        if (near.distance - thickness_.at(item.t) <= tolerance_ || passed || through) {
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
        out.distance = std::max(best_.near.distance - thickness_.at(t), 0.0);
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
        std::pair<Triangle, Triangle> out{a_.triangle(faceA), b_.triangle(faceB)};
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
        still.rateSlack = still.thickness = still.thickening = 0;
        still.horizon = 1;
        struct Task {
            Part a, b;
        };
        std::vector<Task> tasks{{0, 0}};
        const auto farther = [&](float time) {
            const double root = static_cast<double>(time);
            return root * root > best_.near.distance * unit_;
        };
        while (!tasks.empty() && best_.near.distance > 0 && !work_.exhausted()) {
            const Task task = tasks.back();
            tasks.pop_back();
            if (a_.isLeaf(task.a) && b_.isLeaf(task.b)) {
                eachLeafPair(task.a, task.b, still, [&](float time, std::uint32_t a, std::uint32_t b) {
                    if (!farther(time)) offer(a, b);
                });
            } else {
                eachPart(task.a, task.b, still, [&](float time, Part a, Part b) {
                    if (!farther(time)) tasks.push_back({a, b});
                });
            }
        }
    }

    /// Both bodies at one moment.
    struct Moment {
        double t = -1;
        BodyMoment a, b;
    };

    const BodyA& a_;
    const BodyB& b_;
    const kernel::ImpactKernels& kernels_;
    QueryWork& work_;
    const ImpactOptions& options_;
    Thickness thickness_;
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

}  // namespace tessera
