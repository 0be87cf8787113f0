/// One transform's motion in a step: what may be in its way, and how far it gets. Motions that have nothing to do with
/// each other may be tried at the same time.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "server/collision/pipeline/Admission.h"
#include "server/collision/pipeline/PairMemory.h"
#include "server/collision/response/Response.h"

namespace tessera {

class Workers;

/// What motions are tried with.
struct MotionTools {
    const ObjectHandler& handler;
    PairMemory& memory;
    const CollisionLimits& limits;
    const Response& stop;
    const Response& slide;
};

/// Not thread-safe; different tasks may run on different threads where none reads what another one writes
/// (`independent`) and nothing else changes meanwhile.
class MotionTask {
public:
    /// `states`: of the pairs that may be in the way, by their numbers in the memory.
    struct Obstruction {
        ObstaclePair parts;
        std::uint32_t state = 0;
    };
    MotionTask(const ObjectHandler& handler, const Mover& mover, std::vector<Obstruction> obstructions);

    /// Tries the motion with so much work. Writes what is found to the states of its pairs.
    void run(const MotionTools& tools, std::uint64_t limit);
    /// As if it had not run.
    void takeBack(PairMemory& memory);

    [[nodiscard]] const Mover& mover() const { return mover_; }
    [[nodiscard]] const Resolution& resolution() const { return resolution_; }
    /// Of a motion that has obstacles.
    [[nodiscard]] const MotionTrial& trial() const { return *trial_; }
    [[nodiscard]] std::uint32_t stateOf(const Obstacle& obstacle) const {
        return stateOf_.at(std::uint64_t{obstacle.partA} << 32 | obstacle.partB);
    }
    [[nodiscard]] const QueryWork& work() const { return work_; }
    [[nodiscard]] std::uint64_t pairsTested() const { return pairsTested_; }
    /// Pairs whose touch a limit left open, and those of which the list of contacts has to know.
    [[nodiscard]] std::span<const std::uint32_t> leftOpen() const { return leftOpen_; }
    [[nodiscard]] std::span<const std::uint32_t> changed() const { return changed_; }

    /// Parts that it moves; and all that it looks at.
    [[nodiscard]] std::span<const std::uint32_t> carried() const { return carried_; }
    [[nodiscard]] std::span<const Obstruction> obstructions() const { return obstructions_; }

private:
    [[nodiscard]] std::uint64_t touchingAtStart(const MotionTools& tools, std::uint32_t a, std::uint32_t b);

    Mover mover_;
    std::vector<Obstruction> obstructions_;
    std::vector<std::uint32_t> carried_;
    std::unordered_map<std::uint64_t, std::uint32_t> stateOf_;

    QueryWork work_;
    std::uint64_t pairsTested_ = 0;
    std::optional<MotionTrial> trial_;
    Resolution resolution_;
    std::vector<std::uint32_t> leftOpen_, changed_;
    std::vector<std::pair<std::uint32_t, PairState>> before_;  ///< states as they were
};

/// Runs motions in their order. Neighbours in that order none of which looks at what another one moves run at once,
/// shared among the workers (which may be null); results and work are those of one after the other, whatever the number
/// of threads. `settle(task)` is called for each in order: it adds the task's work to `work` and moves what the task
/// has moved.
class MotionRuns {
public:
    MotionRuns(const MotionTools& tools, Workers* workers, const QueryWork& work)
        : tools_(tools), workers_(workers), work_(work) {}

    template <typename Settle>
    void run(std::span<MotionTask> tasks, const Settle& settle) {
        for (std::size_t first = 0; first < tasks.size();) {
            const std::span<MotionTask> some = tasks.subspan(first, independent(tasks.subspan(first)));
            const std::uint64_t share = tryAll(some);
            for (MotionTask& task : some) {
                tryAgain(task, share);
                settle(task);
            }
            first += some.size();
        }
    }

private:
    /// How many of the first can be tried at once, at least one.
    [[nodiscard]] std::size_t independent(std::span<const MotionTask> tasks);
    /// Each with an equal share of the work that is left, which is returned.
    [[nodiscard]] std::uint64_t tryAll(std::span<MotionTask> tasks);
    /// Where the share was not enough, or more than one after the other would have left.
    void tryAgain(MotionTask& task, std::uint64_t share);
    [[nodiscard]] std::uint64_t left() const {
        return work_.limit - std::min(work_.limit, work_.boxTests + work_.triangleTests);
    }

    MotionTools tools_;
    Workers* workers_;
    const QueryWork& work_;
    std::vector<std::uint64_t> movedIn_;  ///< per part: the last run that moves it
    std::uint64_t run_ = 0;
};

}  // namespace tessera
