/// Keeps bodies from getting through each other, wherever the solver sent them.
///
/// The ways that the solver gave are swept (PathSweep.h). Where two get deeper into each other than contact allows, the
/// places in which they then hold each other become contact points, and their islands are solved again: so they meet
/// with the right normals, and push as they should. What that does not settle in a few rounds is cut: bodies go as far
/// as nothing is met. What is met by something that does not give way is carried along by it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/collision/rigid_bodies/NarrowPhase.h"
#include "server/collision/rigid_bodies/PathSweep.h"

namespace tessera::rigid {

class PathGuard {
public:
    struct Hit {
        std::uint32_t encounter = 0;
        SweepHit found;
    };

    /// The ways of a new frame.
    void begin() { before_.clear(); }

    /// `paths`: per body of the frame. `changed`: per body, whose way nobody has looked at yet. Hits ascend by
    /// encounter. Encounters that had more room than has been used since are not looked at again. `maxTests`: of each
    /// encounter; what is looked at is not counted elsewhere, for where there is much room depends on who was passed.
    /// Without `wantPoints` hits have none.
    [[nodiscard]] std::vector<Hit> find(const FrameBodies& frame, const NarrowPhase& narrow,
                                        std::span<const FrameEncounter> encounters, std::span<const BodyPath> paths,
                                        const std::vector<bool>& changed, std::uint64_t maxTests, Workers* workers,
                                        bool wantPoints = true);

    /// Cuts ways until nothing is met.
    void cut(const FrameBodies& frame, const NarrowPhase& narrow, std::span<const FrameEncounter> encounters,
             std::vector<Hit> hits, std::span<BodyPath> paths, const std::vector<bool>& moves, std::uint64_t maxTests,
             Workers* workers);

private:
    struct Task {
        SweepScratch scratch;
        std::vector<Hit> hits;
    };
    std::vector<Task> tasks_;
    std::vector<double> turning_, strayed_;  ///< per part: by its path; since the paths before
    std::vector<double> room_;               ///< per encounter, of what is left of SweepHit::room
    std::vector<BodyPath> before_;
};

}  // namespace tessera::rigid
