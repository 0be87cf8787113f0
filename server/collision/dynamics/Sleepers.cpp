#include "server/collision/dynamics/Sleepers.h"

#include <algorithm>

namespace tessera::dynamics {

void Sleepers::add(SleepingGroup group) {
    const std::uint64_t key = group.bodies.front();
    for (const std::uint64_t body : group.bodies) groupOf_[body] = key;
    groups_[key] = std::move(group);
    changed_ = true;
}

bool Sleepers::disturbed(const SleepingGroup& group, const FrameBodies& frame, const Vec3d& gravity) {
    if (group.gravity != gravity) return true;
    for (const std::uint64_t id : group.bodies) {
        const std::uint32_t rank = frame.findBody(id);
        if (rank == kNobody) return true;
        const FrameBody& body = frame.bodies[rank];
        if (!body.usable || !body.free || body.given->disturbed || !body.velocity.isZero(0) || !body.spin.isZero(0))
            return true;
    }
    return std::any_of(group.supports.begin(), group.supports.end(), [&](const SleepingGroup::Support& s) {
        const std::uint32_t rank = frame.findPart(s.part);
        if (rank == kNobody || frame.parts[rank].body == kNobody) return true;
        const FramePart& part = frame.parts[rank];
        return frame.bodies[part.body].moving || part.given->tree != s.tree ||
               part.given->world.matrix() != s.world.matrix();
    });
}

SleepingGroup Sleepers::takeGroup(std::map<std::uint64_t, SleepingGroup>::iterator at) {
    SleepingGroup out = std::move(at->second);
    groups_.erase(at);
    for (const std::uint64_t body : out.bodies) groupOf_.erase(body);
    changed_ = true;
    return out;
}

std::vector<SleepingGroup> Sleepers::takeDisturbed(const FrameBodies& frame, const Vec3d& gravity) {
    std::vector<SleepingGroup> out;
    for (auto at = groups_.begin(); at != groups_.end();) {
        const auto next = std::next(at);
        if (disturbed(at->second, frame, gravity)) out.push_back(takeGroup(at));
        at = next;
    }
    return out;
}

SleepingGroup Sleepers::take(std::uint64_t body) {
    return takeGroup(groups_.find(groupOf_.at(body)));
}

void Sleepers::listSupports() {
    if (!changed_) return;
    changed_ = false;
    supports_.clear();
    for (const auto& [key, group] : groups_)
        for (const SleepingGroup::Support& s : group.supports) supports_.push_back(s.part);
    std::sort(supports_.begin(), supports_.end());
    supports_.erase(std::unique(supports_.begin(), supports_.end()), supports_.end());
}

}  // namespace tessera::dynamics
