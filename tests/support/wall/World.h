/// Time, work beside the frames, a network and programs of one thread: what happens is drawn from one seed.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/net/Platform.h"
#include "tests/support/wall/MemoryFeeds.h"
#include "tests/support/wall/MemoryNetwork.h"

namespace tessera::simulation {

/// The time of a timeline. Its date may be set, as people set clocks.
class VirtualTime final : public TimeSource {
public:
    explicit VirtualTime(const Timeline& timeline) : timeline_(timeline) {}
    [[nodiscard]] TimePoint now() const override { return timeline_.now(); }
    [[nodiscard]] DateTime date() const override {
        return kBegin + std::chrono::duration_cast<DateTime::duration>(timeline_.now().time_since_epoch() + ahead);
    }
    Duration ahead{};

private:
    static constexpr DateTime kBegin = std::chrono::sys_days(std::chrono::year(2026) / 11 / 30);
    const Timeline& timeline_;
};

/// Runs programs by turns, each as a production loop would be: when something has come for it, or its time has.
class World {
public:
    explicit World(std::uint64_t seed) : random_(seed), network_(timeline_, random_.fork()), time_(timeline_) {}

    /// A program's loop, whose thread is this one.
    class Program : public std::enable_shared_from_this<Program> {
    public:
        using Turn = std::function<void()>;
        using NextWake = std::function<TimePoint()>;

        /// Something has come for it.
        void poke();
        /// It gets no turns: it hangs.
        void hang(bool hangs);
        /// Each turn begins so late at most: by how much is drawn.
        void slowness(Duration most) { slowness_ = most; }

    private:
        friend class World;
        void schedule(TimePoint when);

        World* world_ = nullptr;
        Turn turn_;
        NextWake nextWake_;
        TimePoint due_ = TimePoint::max();
        Duration slowness_ = 50us;  ///< before a turn begins, at most
        bool hangs_ = false;
    };
    /// Its turns come until the last one who holds it lets it go.
    [[nodiscard]] std::shared_ptr<Program> run(Program::Turn turn, Program::NextWake nextWake);

    /// The platform of a program of that name. `poke`: as MemoryNetwork has it.
    [[nodiscard]] Platform platform(const std::string& program, std::function<void()> poke);

    /// Work beside its frames that has not begun is never done: it was killed. Its links break.
    void kill(const std::string& program);

    /// Until `done`, which is asked after each thing that happens. False: `atMost` is over.
    [[nodiscard]] bool runUntil(const std::function<bool()>& done, Duration atMost);
    void runFor(Duration time) {
        (void)runUntil([] { return false; }, time);
    }

    [[nodiscard]] Timeline& timeline() { return timeline_; }
    [[nodiscard]] Random& random() { return random_; }
    [[nodiscard]] MemoryNetwork& network() { return network_; }
    [[nodiscard]] MemoryFeeds& feeds() { return feeds_; }
    [[nodiscard]] VirtualTime& time() { return time_; }
    [[nodiscard]] TimePoint now() const { return timeline_.now(); }

    /// Before a piece of work beside the frames begins, at most.
    Duration laneDelay = 3ms;

private:
    class SimulatedLane;
    struct LaneState;

    Timeline timeline_;
    Random random_;
    MemoryNetwork network_;
    MemoryFeeds feeds_{timeline_};
    VirtualTime time_;
    std::multimap<std::string, std::weak_ptr<LaneState>> lanes_;  ///< by program
};

}  // namespace tessera::simulation
