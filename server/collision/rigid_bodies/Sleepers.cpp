#include "server/collision/rigid_bodies/Sleepers.h"

#include <algorithm>
#include <utility>

namespace tessera::rigid {

std::vector<std::uint64_t> Sleepers::supports() const {
    std::vector<std::uint64_t> out;
    for (const auto& [part, support] : supports_) out.push_back(part);
    std::sort(out.begin(), out.end());
    return out;
}

std::vector<std::uint64_t> Sleepers::add(SleepingGroup group, std::span<const RigidPart* const> support,
                                         ShapeMemory& shapes) {
    const std::uint64_t key = group.bodies.front();
    for (const std::uint64_t body : group.bodies) groupOf_[body] = key;
    for (const TriangleTree* surface : group.surfaces) shapes.hold(*surface);
    std::vector<std::uint64_t> fresh;
    for (const RigidPart* part : support) {
        const auto [at, isNew] = supports_.try_emplace(part->id);
        if (isNew) {
            at->second.tree = part->tree;
            at->second.world = part->world;
            shapes.hold(*part->tree);
            fresh.push_back(part->id);
        }
        at->second.groups.insert(key);
    }
    groups_[key] = std::move(group);
    return fresh;
}

std::vector<SleepingGroup> Sleepers::takeDisturbed(const FrameBodies& frame, const Vec3d& gravity,
                                                   ShapeMemory& shapes) {
    std::set<std::uint64_t> keys;
    const auto wakeBody = [&](std::uint64_t id) {
        if (const auto at = groupOf_.find(id); at != groupOf_.end()) keys.insert(at->second);
    };
    const auto wakeAllOn = [&](const Support& support) { keys.insert(support.groups.begin(), support.groups.end()); };
    if (std::exchange(gravity_, gravity) != gravity)
        for (const auto& [key, group] : groups_) keys.insert(key);
    for (const FrameBody& body : frame.bodies) {
        const bool rests =
            body.usable && body.free && !body.given->disturbed && body.velocity.isZero(0) && body.spin.isZero(0);
        const bool twice = &body != frame.bodies.data() && (&body - 1)->given->id == body.given->id;
        if (!rests && !twice) wakeBody(body.given->id);
    }
    for (const FramePart& part : frame.parts) {
        const auto at = supports_.find(part.given->id);
        if (at == supports_.end() || (&part != frame.parts.data() && (&part - 1)->given->id == part.given->id))
            continue;
        if (part.body == kNoBody || frame.bodies[part.body].moving || part.given->tree != at->second.tree ||
            part.given->world.matrix() != at->second.world.matrix())
            wakeAllOn(at->second);
    }
    for (const std::uint64_t id : std::exchange(gone_, {})) {
        wakeBody(id);
        if (const auto at = supports_.find(id); at != supports_.end()) wakeAllOn(at->second);
    }
    std::vector<SleepingGroup> out;
    for (const std::uint64_t key : keys) out.push_back(takeGroup(groups_.find(key), shapes));
    return out;
}

SleepingGroup Sleepers::takeGroup(std::map<std::uint64_t, SleepingGroup>::iterator at, ShapeMemory& shapes) {
    const std::uint64_t key = at->first;
    SleepingGroup out = std::move(at->second);
    groups_.erase(at);
    for (const std::uint64_t body : out.bodies) groupOf_.erase(body);
    for (const TriangleTree* surface : out.surfaces) shapes.release(surface);
    for (const std::uint64_t part : out.supports) {
        const auto support = supports_.find(part);
        support->second.groups.erase(key);
        if (!support->second.groups.empty()) continue;
        shapes.release(support->second.tree);
        supports_.erase(support);
    }
    return out;
}

SleepingGroup Sleepers::take(std::uint64_t body, ShapeMemory& shapes) {
    return takeGroup(groups_.find(groupOf_.at(body)), shapes);
}

}  // namespace tessera::rigid
