// Requests that aim: picks, and hands on manipulators.
#include <fmt/format.h>

#include "server/collision/pipeline/ScenePicker.h"
#include "server/sim/desk/RequestDesk.h"
#include "server/sim/frame/Simulation.h"

namespace tessera {

ServerActions RequestDesk::on(const Asker& asker, const request::PickAt& wish, TimePoint) {
    const Expected<Ray> ray = rayOf(wish.aim);
    if (!ray) return refuse(asker, ray.error());
    answer::Picked picked{
        .hit = false, .node = {}, .face = 0, .point = Vec3d::Zero(), .xPx = wish.aim.xPx, .yPx = wish.aim.yPx};
    if (const std::optional<PickHit> hit = around_.simulation.pick(*ray)) {
        picked.hit = true;
        picked.node = hit->node;
        picked.face = hit->face;
        picked.point = hit->point;
        picked.t = hit->t * ray->direction.norm();
        picked.normal = hit->details.normal;
        picked.corners = hit->details.weights.tail<2>();
        picked.texcoord = hit->details.texcoord;
    }
    ServerActions actions = news_.picked(picked);
    append(actions, answer(asker, ApplicationAnswer(picked)));
    return actions;
}

ServerActions RequestDesk::on(const Asker& asker, const request::GrabHandle& wish, TimePoint) {
    const Expected<Ray> ray = rayOf(wish.aim);
    if (!ray) return refuse(asker, ray.error());
    if (const std::optional<Error> why = editsRefused()) return refuse(asker, *why);
    Simulation& simulation = around_.simulation;
    const auto drivers = [&](const ChangeList& list) { return simulation.drivingWhat(list); };
    const Expected<ManipulatorDrags::Held> held =
        around_.drags.grab(simulation.scene(), simulation.manipulators(), asker.connection.value, *ray, drivers);
    if (!held) return refuse(asker, held.error());
    return answer(asker, ApplicationAnswer(answer::Picked{.hit = held->any,
                                                          .node = held->node,
                                                          .face = static_cast<std::uint32_t>(held->handle),
                                                          .point = held->point,
                                                          .xPx = wish.aim.xPx,
                                                          .yPx = wish.aim.yPx,
                                                          .t = held->t}));
}

ServerActions RequestDesk::on(const Asker& asker, const request::DragHandle& wish, TimePoint now) {
    const Expected<Ray> ray = rayOf(wish.aim);
    if (!ray) return refuse(asker, ray.error());
    const std::uint64_t holder = asker.connection.value;
    Simulation& simulation = around_.simulation;
    const auto drivers = [&](const ChangeList& list) { return simulation.drivingWhat(list); };
    Expected<ChangeList> list = around_.drags.drag(simulation.scene(), holder, *ray, drivers);
    if (!list) return refuse(asker, list.error());
    if (list->empty())
        return answer(
            asker, ApplicationAnswer(answer::Committed{.sequence = simulation.sequence(), .ids = {}, .stopped = {}}));
    const std::uint64_t ticket = nextTicket_++;
    // Not a number that proposals of this application could name: theirs count from 1 up.
    const Gesture gesture{holder, ~around_.drags.gesture(holder)};
    open_[ticket] = {.asker = asker, .edit = {.ticket = ticket, .list = std::move(*list), .gesture = gesture}};
    return queueEdit(ticket, {}, now);
}

ServerActions RequestDesk::on(const Asker& asker, const request::ReleaseHandle&, TimePoint) {
    around_.drags.release(asker.connection.value);
    return answer(asker, ApplicationAnswer(answer::Done{}));
}

Expected<Ray> RequestDesk::rayOf(const Aim& wish) const {
    if (wish.ray) return *wish.ray;
    if (wish.wand.empty()) {
        const Expected<View> view = around_.view.view(around_.simulation.scene());
        if (!view) return tl::unexpected(view.error());
        return pickRay(around_.wall, *view, wish.xPx, wish.yPx);
    }
    const notice::Poses poses = around_.poses ? around_.poses() : notice::Poses();
    std::string names;
    for (const WandState& wand : poses.wands) {
        if (wand.name == wish.wand) {
            if (wand.tracked) return Ray{wand.worldPosition, wand.worldOrientation * -Vec3d::UnitZ()};
            return fail(ErrorCode::kRefused,
                        fmt::format("wand {} is not tracked at present; see tessera-ctl trackers", wand.name));
        }
        names += (names.empty() ? "" : ", ") + wand.name;
    }
    return fail(ErrorCode::kNotFound,
                fmt::format("no wand is called '{}'; the wall has: {}", wish.wand, names.empty() ? "none" : names));
}

}  // namespace tessera
