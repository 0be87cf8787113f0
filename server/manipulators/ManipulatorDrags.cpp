#include "server/manipulators/ManipulatorDrags.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/cores/ComponentTransform.h"
#include "common/cores/SpotLight.h"
#include "common/cores/Transform.h"
#include "common/scene/FieldTable.h"

namespace tessera {
namespace {

bool isRay(const Ray& ray) {
    return ray.origin.allFinite() && ray.direction.allFinite() && !ray.direction.isZero(0);
}

/// A list that writes all that the handle may.
ChangeList probe(const MovedCore& moved) {
    ChangeListBuilder list;
    if (moved.component) {
        const ComponentTransform fresh;
        setField<&ComponentTransform::translation>(list, moved.core, fresh.translation);
        setField<&ComponentTransform::center>(list, moved.core, fresh.center);
        setField<&ComponentTransform::rotation>(list, moved.core, fresh.rotation);
        setField<&ComponentTransform::scale>(list, moved.core, fresh.scale);
    } else {
        const Transform fresh;
        setField<&Transform::translation>(list, moved.core, fresh.translation);
        setField<&Transform::rotation>(list, moved.core, fresh.rotation);
        setField<&Transform::scale>(list, moved.core, fresh.scale);
    }
    return list.take();
}

Expected<void> checkFree(const Aspect& scene, const MovedCore& moved, const ManipulatorDrags::Drivers& drivers) {
    const std::vector<ObjectId> driving = drivers ? drivers(probe(moved)) : std::vector<ObjectId>();
    if (driving.empty()) return {};
    return fail(
        ErrorCode::kRefused,
        fmt::format("{} is driven by {} #{}, which plays: pause that first (playing), and the handle can be dragged",
                    pathOf(scene, moved.node), scene.find(driving.front()).info().name, driving.front().value));
}

}  // namespace

Expected<ManipulatorDrags::Held> ManipulatorDrags::grab(const Aspect& scene, ManipulatorDisplay& display,
                                                        std::uint64_t holder, const Ray& ray, const Drivers& drivers) {
    if (!isRay(ray)) return fail(ErrorCode::kBadInput, "a ray needs finite numbers and a direction");
    release(holder);
    std::optional<PlacedManipulator> nearest;
    HandleHit hit;
    const std::size_t user = userOf(ray);
    for (PlacedManipulator& placed : display.placed(scene)) {
        const std::optional<HandleHit> here = hitOf(placed.seenBy(user).handles, placed.frame.world_T_frame, ray);
        if (!here || (nearest && here->t >= hit.t)) continue;
        hit = *here;
        nearest = std::move(placed);
    }
    if (!nearest) return Held{};
    for (const auto& [who, hold] : held_) {
        if (!stands(scene, hold)) continue;
        if (hold.core == nearest->core)
            return fail(ErrorCode::kRefused, fmt::format("somebody else holds {}", pathOf(scene, nearest->node)));
        if (hold.grab.moved.core == nearest->moved.core)
            return fail(ErrorCode::kRefused, fmt::format("{} is held by {}, which somebody else drags",
                                                         pathOf(scene, nearest->moved.node), pathOf(scene, hold.node)));
    }
    if (const Expected<void> free = checkFree(scene, nearest->moved, drivers); !free)
        return tl::unexpected(free.error());
    const Manipulator& manipulator = *scene.get<Manipulator>(nearest->core);
    const std::optional<Grab> grab =
        grabAt(nearest->seenBy(user).handles.of[static_cast<std::size_t>(hit.handle - 1)], nearest->seenBy(user).frame,
               nearest->moved, ray, hit.t, manipulator.snap, outerAngleOf(scene, manipulator));
    if (!grab) return Held{};
    Hold hold{.node = nearest->node,
              .core = nearest->core,
              .handle = hit.handle,
              .grab = *grab,
              .light = {},
              .gesture = ++grabs_};
    if (manipulator.kind == Manipulator::kSpotLight) hold.light = scene.get<Node>(manipulator.target)->core;
    held_.insert_or_assign(holder, hold);
    return Held{.any = true,
                .node = nearest->node,
                .handle = hit.handle,
                .point = ray.origin + hit.t * ray.direction,
                .t = hit.t * ray.direction.norm()};
}

Expected<ChangeList> ManipulatorDrags::drag(const Aspect& scene, std::uint64_t holder, const Ray& ray,
                                            const Drivers& drivers) {
    if (!isRay(ray)) return fail(ErrorCode::kBadInput, "a ray needs finite numbers and a direction");
    const auto found = held_.find(holder);
    if (found == held_.end()) return fail(ErrorCode::kRefused, "no handle is held: grab one first");
    const Hold& hold = found->second;
    if (!stands(scene, hold)) {
        held_.erase(found);
        return fail(ErrorCode::kRefused, "the manipulator that was held, or what it moves, is not there any more");
    }
    if (const Expected<void> free = checkFree(scene, hold.grab.moved, drivers); !free) {
        held_.erase(found);
        return tl::unexpected(free.error());
    }
    const std::optional<Dragged> to = dragged(hold.grab, ray);
    if (!to) return ChangeList();
    // Compared with what is there now: who comes back to where it was grabbed must write that, too.
    std::optional<MovedCore> now = movedBy(scene, *scene.get<Manipulator>(hold.core));
    if (!now || now->core != hold.grab.moved.core) return ChangeList();
    ChangeListBuilder list;
    const Pose& wanted = to->pose;
    writePose(list, *now, wanted, to->center ? to->center : std::optional(hold.grab.moved.center));
    if (const auto* light = scene.get<SpotLight>(hold.light); to->outerAngle && light) {
        const float angle = std::min(static_cast<float>(*to->outerAngle), SpotLight::kWidest);
        if (angle != light->outerAngle) setField<&SpotLight::outerAngle>(list, hold.light, angle);
    }
    return list.take();
}

std::size_t ManipulatorDrags::userOf(const Ray& ray) const {
    const auto away = [&](const Vec3d& head) { return (head - ray.origin).squaredNorm(); };
    const auto nearest = std::ranges::min_element(heads_, {}, away);
    return nearest == heads_.end() ? 0 : static_cast<std::size_t>(nearest - heads_.begin());
}

std::uint64_t ManipulatorDrags::gesture(std::uint64_t holder) const {
    const auto found = held_.find(holder);
    return found == held_.end() ? 0 : found->second.gesture;
}

bool ManipulatorDrags::stands(const Aspect& scene, const Hold& hold) {
    const Node* node = scene.get<Node>(hold.node);
    const Manipulator* manipulator = node && node->core == hold.core ? scene.get<Manipulator>(hold.core) : nullptr;
    if (!manipulator) return false;
    const std::optional<MovedCore> moved = movedBy(scene, *manipulator);
    return moved && moved->core == hold.grab.moved.core;
}

ChangeList ManipulatorDrags::corrections(const Aspect& scene, const ManipulatorDisplay& display) {
    std::erase_if(held_, [&](const auto& entry) { return !stands(scene, entry.second); });
    ChangeListBuilder list;
    for (const auto& [node, core] : display.bearers()) {
        std::int64_t handle = 0;
        for (const auto& [who, hold] : held_)
            if (hold.core == core) handle = hold.handle;
        if (scene.get<Manipulator>(core)->held != handle) setField<&Manipulator::held>(list, core, handle);
    }
    return list.take();
}

}  // namespace tessera
