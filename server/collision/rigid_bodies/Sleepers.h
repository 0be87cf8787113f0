/// Who sleeps, with whom, on what, and what wakes them.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <unordered_map>
#include <vector>

#include "server/collision/rigid_bodies/ContactMemory.h"
#include "server/collision/rigid_bodies/FrameBodies.h"

namespace tessera::rigid {

/// Bodies that lie on each other fall asleep together and wake together.
struct SleepingGroup {
    struct Pair {
        std::uint64_t partA = 0, partB = 0;
        std::uint64_t bodyA = 0, bodyB = 0;
        ContactLaw law = ContactLaw::kBounce;
        PairMemory memory;
    };
    std::vector<std::uint64_t> bodies;
    std::vector<Pair> pairs;          ///< encounters that have contacts: nobody need pass them while they sleep
    std::vector<PointMemory> points;  ///< of the pairs
    /// Parts that nothing moves and that one of them leans on; ascending, each once.
    std::vector<std::uint64_t> supports;
    std::vector<const TriangleTree*> surfaces;  ///< of the bodies, held
};

/// A frame costs what it is given and what is woken, however many sleep.
class Sleepers {
public:
    [[nodiscard]] bool asleep(std::uint64_t body) const { return groupOf_.contains(body); }
    [[nodiscard]] std::size_t size() const { return groupOf_.size(); }
    [[nodiscard]] bool supports(std::uint64_t part) const { return supports_.contains(part); }
    /// Ascending.
    [[nodiscard]] std::vector<std::uint64_t> supports() const;

    /// `support`: the parts that the group leans on, in their order, as they are. Says which of them nobody leaned on.
    std::vector<std::uint64_t> add(SleepingGroup group, std::span<const RigidPart* const> support, ShapeMemory& shapes);
    void gone(std::uint64_t id) { gone_.push_back(id); }
    /// Takes out, and gives, the groups in which something is no longer as it was when they fell asleep: of what is in
    /// the frame and what is gone. In the order of their first bodies.
    [[nodiscard]] std::vector<SleepingGroup> takeDisturbed(const FrameBodies& frame, const Vec3d& gravity,
                                                           ShapeMemory& shapes);
    [[nodiscard]] SleepingGroup take(std::uint64_t body, ShapeMemory& shapes);

private:
    /// A part as it has been since the first of them fell asleep on it: where it is elsewhere, all wake.
    struct Support {
        const TriangleTree* tree = nullptr;
        Affine3d world = Affine3d::Identity();
        std::set<std::uint64_t> groups;
    };
    SleepingGroup takeGroup(std::map<std::uint64_t, SleepingGroup>::iterator at, ShapeMemory& shapes);

    std::map<std::uint64_t, SleepingGroup> groups_;             ///< by their first body
    std::unordered_map<std::uint64_t, std::uint64_t> groupOf_;  ///< looked up, never walked
    std::unordered_map<std::uint64_t, Support> supports_;       ///< by part
    std::vector<std::uint64_t> gone_;
    Vec3d gravity_ = Vec3d::Zero();
};

}  // namespace tessera::rigid
