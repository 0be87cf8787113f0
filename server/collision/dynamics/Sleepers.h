/// Who sleeps, with whom, on what, and what wakes them.
#pragma once

#include <cstdint>
#include <map>
#include <unordered_map>
#include <vector>

#include "server/collision/dynamics/ContactMemory.h"
#include "server/collision/dynamics/FrameBodies.h"

namespace tessera::dynamics {

/// Bodies that lie on each other fall asleep together and wake together.
struct SleepingGroup {
    struct Pair {
        std::uint64_t partA = 0, partB = 0;
        ContactLaw law = ContactLaw::kBounce;
        PairMemory memory;
    };
    /// A part that nothing moves and that one of them leans on, as it was.
    struct Support {
        std::uint64_t part = 0;
        const TriangleTree* tree = nullptr;
        Affine3d world = Affine3d::Identity();
    };
    std::vector<std::uint64_t> bodies;
    std::vector<Pair> pairs;          ///< encounters that have contacts: nobody need pass them while they sleep
    std::vector<PointMemory> points;  ///< of the pairs
    std::vector<Support> supports;    ///< ascending, each once
    Vec3d gravity = Vec3d::Zero();
};

class Sleepers {
public:
    [[nodiscard]] bool asleep(std::uint64_t body) const { return groupOf_.contains(body); }
    /// Ascending, each once.
    [[nodiscard]] const std::vector<std::uint64_t>& supports() const { return supports_; }

    void add(SleepingGroup group);
    /// Takes out, and gives, the groups in which something is no longer as it was when they fell asleep.
    [[nodiscard]] std::vector<SleepingGroup> takeDisturbed(const FrameBodies& frame, const Vec3d& gravity);
    [[nodiscard]] SleepingGroup take(std::uint64_t body);
    /// After changes: what supports() says.
    void listSupports();

private:
    [[nodiscard]] static bool disturbed(const SleepingGroup& group, const FrameBodies& frame, const Vec3d& gravity);
    SleepingGroup takeGroup(std::map<std::uint64_t, SleepingGroup>::iterator at);

    std::map<std::uint64_t, SleepingGroup> groups_;             ///< by their first body
    std::unordered_map<std::uint64_t, std::uint64_t> groupOf_;  ///< looked up, never walked
    std::vector<std::uint64_t> supports_;
    bool changed_ = false;
};

}  // namespace tessera::dynamics
