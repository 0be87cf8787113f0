#include "server/collision/response/Way.h"

#include <algorithm>
#include <cmath>

#include "server/collision/query/TouchQuery.h"

namespace tessera {

Pose Way::at(double fraction) const {
    if (fraction <= 0) return start;
    if (fraction >= 1) return end;
    Pose value;
    value.translation = start.translation + fraction * (end.translation - start.translation);
    value.rotation = start.rotation.normalized().slerp(fraction, end.rotation.normalized()).normalized();
    value.scale = start.scale + fraction * (end.scale - start.scale);
    return value;
}

Affine3d localOf(const Pose& value) {
    return composeTransform(value.translation, value.rotation, value.scale);
}

bool possible(const Pose& value) {
    const double norm = value.rotation.coeffs().norm();
    return value.translation.allFinite() && value.scale.allFinite() && value.rotation.coeffs().allFinite() &&
           std::isfinite(norm) && norm > 1e-100 && (value.scale.array() != 0).all();
}

double stretchOf(const Mat3d& m) {
    // |M|² is the largest eigenvalue of MᵀM, which its largest row sum bounds.
    const Mat3d square = m.transpose() * m;
    return std::sqrt(square.cwiseAbs().rowwise().sum().maxCoeff()) * (1 + 1e-12);
}

namespace {

/// The reach of a set of points seen from a frame's origin, and bounds on its motion there.
struct Reach {
    double radius = 0;
    double speed = 0;         // first derivative by the fraction
    double acceleration = 0;  // second, all on one fraction
    double bow = 0;           // second, summed over the places' own fractions
};

/// p(f) = t(f) + R(f)·S(f)·u(f): |R'| <= θ, |R''| <= θ² for a slerp over θ; t and S are linear. The product rule for
/// what is below.
Reach onWay(const Reach& below, const Way& way) {
    const double angle = way.start.rotation.normalized().angularDistance(way.end.rotation.normalized());
    const double size = std::max(way.start.scale.cwiseAbs().maxCoeff(), way.end.scale.cwiseAbs().maxCoeff());
    const double growth = (way.end.scale - way.start.scale).cwiseAbs().maxCoeff();
    const double shift = (way.end.translation - way.start.translation).norm();
    const double turn = angle * size + growth;                            // |(RS)'|
    const double turnOfTurn = angle * angle * size + 2 * angle * growth;  // |(RS)''|
    Reach out;
    out.radius = std::max(way.start.translation.norm(), way.end.translation.norm()) + size * below.radius;
    out.speed = shift + turn * below.radius + size * below.speed;
    out.acceleration = turnOfTurn * below.radius + 2 * turn * below.speed + size * below.acceleration;
    out.bow = turnOfTurn * below.radius + size * below.bow;
    return out;
}

Reach through(const Reach& below, const Affine3d& fixed) {
    const double stretch = stretchOf(fixed.linear());
    return {fixed.translation().norm() + stretch * below.radius, stretch * below.speed, stretch * below.acceleration,
            stretch * below.bow};
}

}  // namespace

WayBound boundWay(const ObjectHandler& handler, std::uint32_t partNumber, const WayLookup& wayOf) {
    const Part& part = handler.parts()[partNumber];
    WayBound bound;
    if (!part.shape) return bound;
    Affine3d fixed = Affine3d::Identity();  // what stands still since the last moving transform, upwards
    Reach reach;
    for (std::uint32_t at = part.place; at != Place::kNone; at = handler.places()[at].parent) {
        const Place& place = handler.places()[at];
        if (!place.transform) continue;
        const Way* way = wayOf(place.transform);
        if (!way) {
            fixed = place.local * fixed;
            continue;
        }
        if (bound.bends++ == 0) {
            const Box& box = part.shape->mesh().bounds();
            for (int corner = 0; corner < 8; ++corner) {
                const Vec3d p((corner & 1) ? box.upper.x() : box.lower.x(),
                              (corner & 2) ? box.upper.y() : box.lower.y(),
                              (corner & 4) ? box.upper.z() : box.lower.z());
                reach.radius = std::max(reach.radius, (fixed * p).norm());
            }
        } else {
            reach = through(reach, fixed);
        }
        reach = onWay(reach, *way);
        fixed = Affine3d::Identity();
    }
    if (bound.bends == 0) return bound;
    reach = through(reach, fixed);
    constexpr double kRounding = 1 + 1e-12;
    bound.length = reach.speed * kRounding;
    bound.curvature = reach.acceleration * kRounding;
    bound.bow = reach.bow * kRounding;
    return bound;
}

Box boxOnAllWays(const ObjectHandler& handler, std::uint32_t partNumber, const WayLookup& wayOf) {
    const Part& part = handler.parts()[partNumber];
    const WayBound bound = boundWay(handler, partNumber, wayOf);
    Box box = part.worldBox;
    if (bound.bends == 0 || !part.solid()) return box;
    double margin = bound.length;
    constexpr int kMaxBends = 4;
    if (bound.bends <= kMaxBends) {
        // Without rotation the pose is linear in each fraction, so its extremes are at the ends.
        std::vector<std::uint32_t> chain;  // from the part to the root
        for (std::uint32_t at = part.place; at != Place::kNone; at = handler.places()[at].parent) chain.push_back(at);
        for (unsigned ends = 0; ends < 1u << bound.bends; ++ends) {
            Affine3d world = Affine3d::Identity();
            int bend = 0;
            for (auto at = chain.rbegin(); at != chain.rend(); ++at) {
                const Place& place = handler.places()[*at];
                if (!place.transform) continue;
                const Way* way = wayOf(place.transform);
                world = world * (way ? localOf(way->at(ends >> bend & 1u)) : place.local);
                bend += way != nullptr;
            }
            box.extend(conservativeBox(world, part.shape->mesh().bounds()));
        }
        margin = bound.bow / 8;
    }
    box.lower -= Vec3d::Constant(margin);
    box.upper += Vec3d::Constant(margin);
    return box;
}

PartOnTheWay::PartOnTheWay(const ObjectHandler& handler, std::uint32_t partNumber, ObjectId transform) {
    std::vector<Step> upwards;
    for (std::uint32_t at = handler.parts()[partNumber].place; at != Place::kNone; at = handler.places()[at].parent) {
        const Place& place = handler.places()[at];
        if (!place.transform) continue;
        upwards.push_back({place.transform == transform, place.local});
        if (place.transform != transform) continue;
        if (carrier_ == Place::kNone) carrier_ = at;
        above_ = place.parent == Place::kNone ? Affine3d(Affine3d::Identity()) : handler.places()[place.parent].world;
        path_.assign(upwards.rbegin(), upwards.rend());
    }
}

Affine3d PartOnTheWay::world(const Affine3d& local) const {
    Affine3d world = above_;
    for (const Step& step : path_) world = world * (step.onTheWay ? local : step.local);
    return world;
}

}  // namespace tessera
