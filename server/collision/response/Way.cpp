#include "server/collision/response/Way.h"

#include <algorithm>
#include <cmath>

#include "common/math/Compose.h"
#include "server/collision/pairwise/ConservativeBox.h"
#include "server/collision/response/Reach.h"

namespace tessera {

namespace {

/// What stays keeps its value exactly. Between finite places the difference may not be finite.
Vec3d between(const Vec3d& start, const Vec3d& end, double fraction) {
    const Vec3d value = start + fraction * (end - start);
    return value.allFinite() ? value : Vec3d((1 - fraction) * start + fraction * end);
}

}  // namespace

Pose Way::at(double fraction) const {
    if (fraction <= 0) return start;
    if (fraction >= 1) return end;
    Pose value;
    value.translation = between(start.translation, end.translation, fraction);
    value.rotation = start.rotation.normalized().slerp(fraction, end.rotation.normalized()).normalized();
    value.scale = between(start.scale, end.scale, fraction);
    return value;
}

Affine3d localOf(const Pose& value) {
    return composeTransform(value.translation, value.rotation, value.scale);
}

bool possible(const Pose& value) {
    return value.sound() && (value.scale.array() != 0).all();
}

WayBound boundWay(const ObjectHandler& handler, std::uint32_t partNumber, const WayLookup& wayOf) {
    const Part& part = handler.parts()[partNumber];
    WayBound bound;
    if (!part.shape) return bound;
    Affine3d fixed = Affine3d::Identity();  // what stands still since the last moving transform, upwards
    Reach reach;
    for (std::uint32_t at = part.place; at != Place::kNone; at = handler.places()[at].frame()) {
        const Place& place = handler.places()[at];
        if (!place.transform) continue;
        const Way* way = wayOf(place.transform);
        if (!way) {
            fixed = place.local * fixed;
            continue;
        }
        if (bound.bends++ == 0)
            reach.radius = radiusOf(part.shape->bounds(), fixed);
        else
            reach = through(reach, fixed);
        reach = onWay(reach, *way);
        fixed = Affine3d::Identity();
    }
    if (bound.bends == 0) return bound;
    reach = through(reach, fixed);
    constexpr double kRounding = 1 + 1e-12;
    bound.length = reach.speed * kRounding;
    bound.curvature = reach.acceleration * kRounding;
    bound.bow = reach.bow * kRounding;
    bound.drift = reach.drift * kRounding;
    return bound;
}

Box boxOnAllWays(const ObjectHandler& handler, std::uint32_t partNumber, const WayLookup& wayOf, bool slides) {
    const Part& part = handler.parts()[partNumber];
    const WayBound bound = boundWay(handler, partNumber, wayOf);
    Box box = part.worldBox;
    if (bound.bends == 0 || !part.solid()) return box;
    double margin = bound.length;
    constexpr int kMaxBends = 4;
    if (bound.bends <= kMaxBends) {
        // Without rotation the pose is linear in each fraction, so its extremes are at the ends.
        std::vector<std::uint32_t> chain;  // from the part to the root
        for (std::uint32_t at = part.place; at != Place::kNone; at = handler.places()[at].frame()) chain.push_back(at);
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
            box.extend(boxAround(world, part.shape->bounds()));
        }
        margin = bound.bow / 8;
    }
    if (slides) margin += bound.drift;
    box.lower -= Vec3d::Constant(margin);
    box.upper += Vec3d::Constant(margin);
    return box;
}

PartOnTheWay::PartOnTheWay(const ObjectHandler& handler, std::uint32_t partNumber, ObjectId transform) {
    std::vector<Step> upwards;
    for (std::uint32_t at = handler.parts()[partNumber].place; at != Place::kNone; at = handler.places()[at].frame()) {
        const Place& place = handler.places()[at];
        if (!place.transform) continue;
        upwards.push_back({place.transform == transform, place.local});
        if (place.transform != transform) continue;
        if (carrier_ == Place::kNone) carrier_ = at;
        above_ = place.parent == Place::kNone ? Affine3d(Affine3d::Identity()) : handler.places()[place.parent].world;
        path_.assign(upwards.rbegin(), upwards.rend());
    }
    // Below something that stands in the world, it stays where it is.
    if (carrier_ == Place::kNone) above_ = handler.parts()[partNumber].world;
}

std::optional<Mat3d> PartOnTheWay::frameAbove() const {
    const auto onTheWay = std::count_if(path_.begin(), path_.end(), [](const Step& step) { return step.onTheWay; });
    if (onTheWay != 1) return std::nullopt;
    return Mat3d(above_.linear());
}

Affine3d PartOnTheWay::world(const Affine3d& local) const {
    Affine3d world = above_;
    for (const Step& step : path_) world = world * (step.onTheWay ? local : step.local);
    return world;
}

}  // namespace tessera
