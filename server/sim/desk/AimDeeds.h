/// Requests that point into the scene: picks, distances, hands on manipulators. For Deeds.cpp alone.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <memory>

#include "server/collision/pipeline/AsideQuery.h"
#include "server/sim/desk/AimedRays.h"
#include "server/sim/desk/DeedTable.h"
#include "server/sim/frame/Simulation.h"

namespace tessera::aim_deeds {

/// So much at once; what takes longer is answered beside the frames, where that can be.
inline PickPatience patienceOf(const Desk& desk) {
    if (!desk.around.workBeside) return {.maxMadeFaces = std::numeric_limits<std::size_t>::max()};
    return {.work = {.limit = desk.limits.maxPickWork}};
}

/// `begin` puts a question together once it is this application's turn (an optional AsidePick or AsideNearest), and
/// `tell` is called with it once it has been answered elsewhere; null: too much stands there.
template <typename Begin, typename Tell>
ServerActions answerAside(Desk& desk, const Asker& asker, Begin begin, Tell tell) {
    return desk.works.ask(asker, 0, [&desk, asker, begin, tell] {
        const auto question = std::make_shared<decltype(begin())>(begin());
        desk.around.workBeside([&desk, asker, tell, question, closing = desk.closing]() -> WorkedOut {
            if (*question) (*question)->answer(closing.get());
            return [&desk, asker, tell, question](TimePoint) mutable {
                ServerActions told;
                if (desk.applications.contains(asker.connection)) told = tell(*question ? &**question : nullptr);
                if (*question) desk.around.simulation.putShapes(std::move((*question)->made));
                desk.letGo(std::move(question));
                desk.works.done();  // the next one finds what this one has made
                return told;
            };
        });
    });
}

inline ServerActions tooMuchToLookAt(const Desk& desk, const Asker& asker) {
    return desk.refuse(asker, {ErrorCode::kLimit, "too much stands on that way; ask from nearer, or about less"});
}

inline ServerActions tellPicked(Desk& desk, const Asker& asker, const Aim& aim, const Ray& ray,
                                const std::optional<PickHit>& hit) {
    answer::Picked picked{.hit = false, .node = {}, .face = 0, .point = Vec3d::Zero(), .xPx = aim.xPx, .yPx = aim.yPx};
    if (hit) {
        picked.hit = true;
        picked.node = hit->node;
        picked.face = hit->face;
        picked.point = hit->point;
        picked.t = hit->t * ray.direction.norm();
        picked.normal = hit->details.normal;
        picked.corners = hit->details.weights.tail<2>();
        picked.texcoord = hit->details.texcoord;
    }
    ServerActions actions = desk.news.picked(picked);
    append(actions, desk.answer(asker, ApplicationAnswer(picked)));
    return actions;
}

inline ServerActions pick(Desk& desk, const Asker& asker, const request::PickAt& wish, TimePoint) {
    const Expected<Ray> ray = rayOf(desk.around, wish.aim);
    if (!ray) return desk.refuse(asker, ray.error());
    PickPatience patience = patienceOf(desk);
    const std::optional<PickHit> found = desk.around.simulation.pick(*ray, &patience);
    desk.letGo();
    if (!patience.over()) return tellPicked(desk, asker, wish.aim, *ray, found);
    return answerAside(
        desk, asker, [&desk, ray = *ray] { return desk.around.simulation.pickAside(ray); },
        [&desk, asker, aim = wish.aim, ray = *ray](const AsidePick* question) {
            if (!question || question->exhausted) return tooMuchToLookAt(desk, asker);
            return tellPicked(desk, asker, aim, ray, question->found);
        });
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

inline ServerActions tellMeasured(Desk& desk, const Asker& asker, const request::MeasureDistance& wish,
                                  const std::optional<NearestSurface>& near) {
    if (!near)
        return desk.refuse(
            asker, {ErrorCode::kNotFound, fmt::format("nothing is seen at or below node #{}", wish.node.value)});
    return desk.answer(asker, answer::Measured{.from = wish.from,
                                               .to = near->point,
                                               .distance = near->distance,
                                               .error = near->error,
                                               .node = near->node,
                                               .face = near->face,
                                               .normal = near->details.normal});
}

/// `round`: of what shows nothing, whatever it holds, some is found out each time.
inline ServerActions measureAside(Desk& desk, const Asker& asker, const request::MeasureDistance& wish, int round) {
    constexpr int kMostRounds = 64;
    return answerAside(
        desk, asker, [&desk, wish] { return desk.around.simulation.nearestAside(wish.from, wish.node); },
        [&desk, asker, wish, round](const AsideNearest* question) {
            if (question && question->again && round < kMostRounds) return measureAside(desk, asker, wish, round + 1);
            if (!question || question->exhausted || question->again) return tooMuchToLookAt(desk, asker);
            return tellMeasured(desk, asker, wish, question->found);
        });
}

inline ServerActions measure(Desk& desk, const Asker& asker, const request::MeasureDistance& wish, TimePoint) {
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
    PickPatience patience = patienceOf(desk);
    const std::optional<NearestSurface> near = simulation.nearestSurface(wish.from, wish.node, &patience);
    desk.letGo();
    return patience.over() ? measureAside(desk, asker, wish, 0) : tellMeasured(desk, asker, wish, near);
}

inline constexpr DeedTable kRows{&pick, &grab, &drag, &release, &measure};

}  // namespace tessera::aim_deeds
