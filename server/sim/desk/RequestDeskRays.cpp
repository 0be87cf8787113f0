// Requests that aim: picks, and hands on manipulators.
#include <fmt/format.h>

#include "server/collision/pipeline/ScenePicker.h"
#include "server/sim/desk/RequestDesk.h"
#include "server/sim/frame/Simulation.h"

namespace tessera {

ServerActions RequestDesk::on(const Asker& asker, const request::PickAt& wish, TimePoint) {
    const Expected<Ray> ray = rayOf(wish);
    if (!ray) return refuse(asker, ray.error());
    answer::Picked picked{
        .hit = false, .node = {}, .face = 0, .point = Vec3d::Zero(), .xPx = wish.xPx, .yPx = wish.yPx};
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

ServerActions RequestDesk::on(const Asker& asker, const request::Manipulate& wish, TimePoint now) {
    using Deed = request::Manipulate::Deed;
    const std::uint64_t holder = asker.connection.value;
    Simulation& simulation = around_.simulation;
    if (wish.deed == Deed::kRelease) {
        around_.drags.release(holder);
        return answer(asker, ApplicationAnswer(answer::Done{}));
    }
    const Expected<Ray> ray = wish.ray ? *wish.ray : rayOf(wish.aim);
    if (!ray) return refuse(asker, ray.error());
    const auto drivers = [&](const ChangeList& list) { return simulation.drivingWhat(list); };
    if (wish.deed == Deed::kGrab) {
        if (const std::optional<Error> why = editsRefused()) return refuse(asker, *why);
        const Expected<ManipulatorDrags::Held> held = around_.drags.grab(simulation.scene(), simulation.manipulators(), holder, *ray, drivers);
        if (!held) return refuse(asker, held.error());
        return answer(asker, ApplicationAnswer(answer::Picked{.hit = held->any,
                                                              .node = held->node,
                                                              .face = static_cast<std::uint32_t>(held->handle),
                                                              .point = held->point,
                                                              .xPx = wish.aim.xPx,
                                                              .yPx = wish.aim.yPx,
                                                              .t = held->t}));
    }
    Expected<ChangeList> list = around_.drags.drag(simulation.scene(), holder, *ray, drivers);
    if (!list) return refuse(asker, list.error());
    if (list->empty()) return answer(asker, ApplicationAnswer(answer::Committed{.sequence = simulation.sequence(), .ids = {}, .stopped = {}}));
    const std::uint64_t ticket = nextTicket_++;
    // Not a number that proposals of this application could name: theirs count from 1 up.
    const Gesture gesture{holder, ~around_.drags.gesture(holder)};
    open_[ticket] = {.asker = asker, .edit = {.ticket = ticket, .list = std::move(*list), .gesture = gesture}};
    return queueEdit(ticket, {}, now);
}

Expected<Ray> RequestDesk::rayOf(const request::PickAt& wish) const {
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
