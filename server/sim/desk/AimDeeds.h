/// Requests that point into the scene: picks, distances, hands on manipulators. For Deeds.cpp alone.
#pragma once

#include <fmt/format.h>

#include <cmath>

#include "server/collision/pipeline/ScenePicker.h"
#include "server/sim/desk/AimedRays.h"
#include "server/sim/desk/DeedTable.h"
#include "server/sim/frame/Simulation.h"

namespace tessera::aim_deeds {

/// So much at once; what takes longer is made beside the frames first, where that can be.
inline std::optional<PickPatience> patienceOf(const Desk& desk) {
    if (!desk.around.workBeside) return std::nullopt;
    return PickPatience{.work = {.limit = desk.limits.maxMeasureWork}};
}

inline ServerActions tooMuchToLookAt(const Desk& desk, const Asker& asker) {
    return desk.refuse(asker, {ErrorCode::kLimit, "more stands on that way than can be looked at between two frames"});
}

inline ServerActions pickIn(Desk& desk, const Asker& asker, const request::PickAt& wish, int round) {
    const Expected<Ray> ray = rayOf(desk.around, wish.aim);
    if (!ray) return desk.refuse(asker, ray.error());
    std::optional<PickPatience> patience = patienceOf(desk);
    const std::optional<PickHit> found = desk.around.simulation.pick(*ray, patience ? &*patience : nullptr);
    if (patience && patience->unmade)
        return desk.afterMaking(asker, *patience->unmade, round, [&desk, asker, wish, round](TimePoint) {
            return pickIn(desk, asker, wish, round + 1);
        });
    if (patience && patience->work.exhausted()) return tooMuchToLookAt(desk, asker);
    answer::Picked picked{
        .hit = false, .node = {}, .face = 0, .point = Vec3d::Zero(), .xPx = wish.aim.xPx, .yPx = wish.aim.yPx};
    if (const std::optional<PickHit>& hit = found) {
        picked.hit = true;
        picked.node = hit->node;
        picked.face = hit->face;
        picked.point = hit->point;
        picked.t = hit->t * ray->direction.norm();
        picked.normal = hit->details.normal;
        picked.corners = hit->details.weights.tail<2>();
        picked.texcoord = hit->details.texcoord;
    }
    ServerActions actions = desk.news.picked(picked);
    append(actions, desk.answer(asker, ApplicationAnswer(picked)));
    return actions;
}

inline ServerActions pick(Desk& desk, const Asker& asker, const request::PickAt& wish, TimePoint) {
    return pickIn(desk, asker, wish, 0);
}

inline ServerActions grab(Desk& desk, const Asker& asker, const request::GrabHandle& wish, TimePoint) {
    const Expected<Ray> ray = rayOf(desk.around, wish.aim);
    if (!ray) return desk.refuse(asker, ray.error());
    if (const std::optional<Error> why = desk.around.whyNoEdit()) return desk.refuse(asker, *why);
    Simulation& simulation = desk.around.simulation;
    const auto drivers = [&](const ChangeList& list) { return simulation.drivingWhat(list); };
    const Expected<ManipulatorDrags::Held> held =
        desk.around.drags.grab(simulation.scene(), simulation.manipulators(), asker.connection.value, *ray, drivers);
    if (!held) return desk.refuse(asker, held.error());
    return desk.answer(asker, ApplicationAnswer(answer::Picked{.hit = held->any,
                                                               .node = held->node,
                                                               .face = static_cast<std::uint32_t>(held->handle),
                                                               .point = held->point,
                                                               .xPx = wish.aim.xPx,
                                                               .yPx = wish.aim.yPx,
                                                               .t = held->t}));
}

inline ServerActions drag(Desk& desk, const Asker& asker, const request::DragHandle& wish, TimePoint now) {
    const Expected<Ray> ray = rayOf(desk.around, wish.aim);
    if (!ray) return desk.refuse(asker, ray.error());
    Simulation& simulation = desk.around.simulation;
    const std::uint64_t holder = asker.connection.value;
    const auto drivers = [&](const ChangeList& list) { return simulation.drivingWhat(list); };
    Expected<ChangeList> list = desk.around.drags.drag(simulation.scene(), holder, *ray, drivers);
    if (!list) return desk.refuse(asker, list.error());
    if (list->empty())
        return desk.answer(
            asker, ApplicationAnswer(answer::Committed{.sequence = simulation.sequence(), .ids = {}, .stopped = {}}));
    // Not a number that proposals of this application could name: theirs count from 1 up.
    const Gesture gesture{holder, ~desk.around.drags.gesture(holder)};
    return desk.edits.enter({.asker = asker, .edit = {.list = std::move(*list), .gesture = gesture}}, {}, now);
}

inline ServerActions release(Desk& desk, const Asker& asker, const request::ReleaseHandle&, TimePoint) {
    desk.around.drags.release(asker.connection.value);
    return desk.done(asker);
}

inline ServerActions measureIn(Desk& desk, const Asker& asker, const request::MeasureDistance& wish, int round) {
    if (wish.to) {
        const double distance = (*wish.to - wish.from).stableNorm();
        if (!std::isfinite(distance))
            return desk.refuse(asker, {ErrorCode::kBadInput, "these places are farther apart than a number can tell"});
        return desk.answer(asker, answer::Measured{.from = wish.from, .to = *wish.to, .distance = distance});
    }
    Simulation& simulation = desk.around.simulation;
    if (!simulation.scene().get<Node>(wish.node))
        return desk.refuse(asker,
                           {ErrorCode::kNotFound, fmt::format("there is no node #{} to measure to", wish.node.value)});
    QueryWork work{.limit = desk.limits.maxMeasureWork};
    std::optional<PickPatience> patience = patienceOf(desk);
    const std::optional<NearestSurface> near =
        simulation.nearestSurface(wish.from, wish.node, work, patience ? &*patience : nullptr);
    if (patience && patience->unmade)
        return desk.afterMaking(asker, *patience->unmade, round, [&desk, asker, wish, round](TimePoint) {
            return measureIn(desk, asker, wish, round + 1);
        });
    if (near)
        return desk.answer(asker, answer::Measured{.from = wish.from,
                                                   .to = near->point,
                                                   .distance = near->distance,
                                                   .error = near->error,
                                                   .node = near->node,
                                                   .face = near->face,
                                                   .normal = near->details.normal});
    if (work.exhausted())
        return desk.refuse(asker, {ErrorCode::kLimit,
                                   "too much stands between that place and the node to look at "
                                   "between two frames; name a nearer place"});
    return desk.refuse(asker,
                       {ErrorCode::kNotFound, fmt::format("nothing is seen at or below node #{}", wish.node.value)});
}

inline ServerActions measure(Desk& desk, const Asker& asker, const request::MeasureDistance& wish, TimePoint) {
    return measureIn(desk, asker, wish, 0);
}

inline constexpr DeedTable kRows{&pick, &grab, &drag, &release, &measure};

}  // namespace tessera::aim_deeds
