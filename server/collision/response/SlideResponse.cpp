#include <algorithm>
#include <cmath>

#include "server/collision/response/FreeWay.h"
#include "server/collision/response/Tangent.h"

namespace tessera {

namespace {

constexpr int kMostLegs = 4;  ///< the wanted way and what is left of it, turned
constexpr std::size_t kMostWays = 16;

/// One motion in legs: straight translations, each along everything that was met so far, each as far as its way is
/// free.
class Slide {
public:
    explicit Slide(const MotionTrial& trial) : trial_(trial) {}

    Resolution run() {
        goOn();
        std::vector<std::size_t> by;
        for (const Hit& hit : out_.hits) by.push_back(hit.obstacle);
        if (out_.stopped && leadsNowhere(trial_, by, out_.accepted)) out_.accepted = trial_.way().start;
        return std::move(out_);
    }

private:
    void goOn() {
        FreeWay way = freeWay(trial_, 1);
        out_.accepted = trial_.way().at(way.reached);
        out_.stopped = way.reached < 1;
        out_.undecided = way.undecided;
        if (!out_.stopped) return;
        take(trial_, way, 0, 1);
        if (!meet(trial_, way)) return;
        // The frame that translations are in need not be the world's; surfaces are square to their normals there.
        way.reached = backToGap(trial_, way);
        out_.accepted = trial_.way().at(way.reached);
        left_ = world_T_local_ * (trial_.way().end.translation - out_.accepted.translation);
        double done = way.reached;
        const double least = 1e-9 * left_.norm();
        for (int legs = 1; legs < kMostLegs; ++legs) {
            const Vec3d along = tangent(left_, waysOut_);
            if (along.norm() <= least) return;
            Way next{out_.accepted, out_.accepted};
            next.end.translation += local_T_world_ * along;
            const MotionTrial leg = trial_.leg(next);
            way = freeWay(leg, 1);
            out_.undecided += way.undecided;
            const bool blocked = way.reached < 1;
            if (blocked) take(leg, way, done, 1 - done);
            const bool goesOn = blocked && meet(leg, way);
            if (goesOn) way.reached = backToGap(leg, way);
            out_.accepted = next.at(way.reached);
            left_ *= 1 - way.reached;
            done += (1 - done) * way.reached;
            if (!goesOn) return;
        }
    }

    /// Notes what stands in the way; false where it does not let slide.
    bool meet(const MotionTrial& trial, const FreeWay& way) {
        bool found = false;
        for (std::size_t i = 0; i < way.by.size(); ++i) {
            const std::size_t k = way.by[i];
            if (!trial.obstacles()[k].slide) return false;
            const std::optional<Mat3d> frame = trial.frameAbove(k);
            if (!frame) return false;
            if (!known_) {
                world_T_local_ = *frame;
                local_T_world_ = frame->inverse();
                known_ = true;
            }
            for (const Vec3d& out : waysOut(trial, k, way.contacts[i], way.reached, *frame)) {
                // A translation that takes this part by d takes one under another parent elsewhere.
                const Vec3d here = (local_T_world_.transpose() * (frame->transpose() * out)).normalized();
                if (!here.allFinite() || waysOut_.size() >= kMostWays) continue;
                constexpr double kSame = 1 - 1e-12;
                if (std::any_of(waysOut_.begin(), waysOut_.end(), [&](const Vec3d& w) { return w.dot(here) > kSame; }))
                    continue;
                waysOut_.push_back(here);
                found = true;
            }
        }
        return found;
    }

    static std::vector<Vec3d> waysOut(const MotionTrial& trial, std::size_t obstacle, const Impact& contact,
                                      double reached, const Mat3d& world_T_local) {
        if (!contact.hit || !trial.rests(obstacle)) return trial.waysOut(obstacle, reached);
        if (contact.support >= 0) return {trial.wayOfMover(obstacle, contact.normal)};
        const Vec3d wanted = world_T_local * (trial.way().end.translation - trial.way().start.translation);
        return {trial.wayOutOf(obstacle, contact.faces, reached, wanted.normalized())};
    }

    /// Slides keep half the stop tolerance off what they met, so that they neither stick to it nor to the seams of its
    /// faces. A stop at a flat angle is nearer than that: back along the way; what is lost of it along the surface is
    /// not lost.
    static double backToGap(const MotionTrial& trial, const FreeWay& way) {
        double back = way.reached;
        for (std::size_t i = 0; i < way.by.size(); ++i) {
            const std::size_t k = way.by[i];
            const Impact& contact = way.contacts[i];
            if (!contact.hit || contact.support >= 0) continue;
            const double wanted = 0.5 * trial.tolerance(k);
            const double gap = trial.rests(k) ? trial.gapOf(k, contact.faces, way.reached) : trial.gap(k, way.reached);
            const double rest = way.contacts[i].t - way.reached;
            // The gap closes evenly, but for turns: these are for mayEndAt.
            if (gap < wanted && gap > 0 && rest > 0) back = std::min(back, way.contacts[i].t - rest * wanted / gap);
        }
        back = std::max(0.0, back);
        return back < way.reached && !mayEndAt(trial, back) ? way.reached : back;
    }

    void take(const MotionTrial& trial, const FreeWay& way, double done, double left) {
        for (Hit& hit : hitsOf(trial, way)) {
            const Obstacle& met = trial.obstacles()[hit.obstacle];
            const auto all = trial_.obstacles();
            const auto own = std::find_if(all.begin(), all.end(), [&](const Obstacle& o) {
                return o.partA == met.partA && o.partB == met.partB;
            });
            if (own == all.end()) continue;
            hit.obstacle = static_cast<std::size_t>(own - all.begin());
            hit.fraction = done + left * hit.fraction;
            out_.hits.push_back(std::move(hit));
        }
    }

    const MotionTrial& trial_;
    Resolution out_;
    bool known_ = false;
    Mat3d world_T_local_ = Mat3d::Identity(), local_T_world_ = Mat3d::Identity();
    std::vector<Vec3d> waysOut_;
    Vec3d left_ = Vec3d::Zero();  ///< of the translation, in the world
};

class SlideResponse final : public Response {
public:
    [[nodiscard]] Resolution resolve(const MotionTrial& trial) const override { return Slide(trial).run(); }
};

}  // namespace

std::unique_ptr<Response> makeSlideResponse() {
    return std::make_unique<SlideResponse>();
}

}  // namespace tessera
