/// A wall at work for benchmarks of its frames: a server in this process, four render hosts that do not draw.
#pragma once

#include <atomic>
#include <csignal>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "common/application/Application.h"
#include "common/base/Channel.h"
#include "server/sim/FrameLoop.h"
#include "tests/bench/SceneTable.h"
#include "tests/integration/LiveWall.h"

namespace tessera::bench {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using Instant = Clock::time_point;

[[nodiscard]] double milliseconds(Duration duration);

/// Places with ten places below each, every one a Transform with a box of sixteen sizes in a node below it: half of the
/// nodes are places. `wide`: all places stand below one node.
void writeForest(const std::string& path, std::uint64_t nodes, bool wide);

/// Sees when the whole machine stands still (a shared one may be stopped for tenths of a second): a thread that does
/// nothing but sleep for two milliseconds wakes much later then.
class StandstillWatch {
public:
    StandstillWatch() : thread_([this] { run(); }) {}
    ~StandstillWatch() { (void)take(); }
    struct Standstill {
        Instant from, to;
    };
    std::vector<Standstill> take() {
        stop_ = true;
        if (thread_.joinable()) thread_.join();
        return seen_;
    }

private:
    void run() {
        for (Instant before = Clock::now(); !stop_;) {
            std::this_thread::sleep_for(2ms);
            const Instant now = Clock::now();
            if (now - before > 25ms) seen_.push_back({before, now});
            before = now;
        }
    }
    std::vector<Standstill> seen_;
    std::atomic<bool> stop_{false};
    std::thread thread_;
};

/// The wall at work on threads and processes of its own, and when it has released its frames.
class Wall4 {
public:
    /// Applications may load what lies in folder `allowed`.
    Wall4(std::vector<std::string> scenes, const std::string& allowed, double rateHz,
          std::vector<std::string> lastHost = {});
    [[nodiscard]] std::vector<pid_t> hosts() const {
        std::vector<pid_t> pids;
        for (const auto& host : hosts_) pids.push_back(host->pid());
        return pids;
    }
    void killLastHost() { hosts_.back()->signal(SIGKILL); }
    /// Starts the last host again where it has ended. True: it had.
    bool keepLastHost() {
        if (!hosts_.back()->waitForExit(0s)) return false;
        hosts_.pop_back();
        startHost(test::kFourHosts.back());
        return true;
    }
    ~Wall4() { (void)finish(); }
    [[nodiscard]] std::unique_ptr<Application> connect() const;
    /// Until so many frames have been shown to all.
    void waitForFrames(Application& application, std::uint64_t frames) const;
    /// Ends it: the instants of all releases.
    std::vector<Instant> finish() {
        if (thread_.joinable()) {
            loop_->stop();
            thread_.join();
        }
        return released_;
    }
    /// Processor time of the frame thread up to each release, ms. Once it has ended.
    [[nodiscard]] const std::vector<double>& worked() const { return worked_; }

private:
    void startHost(const std::string& host);

    test::TemporaryFolder folder_;
    Log log_;
    std::vector<std::string> lastHost_;  ///< what its command says beside
    int started_ = 0;
    std::vector<Instant> released_;  ///< the frame thread's until it has ended
    std::vector<double> worked_;     ///< likewise
    Channel<std::string> listening_{1};
    std::unique_ptr<FrameLoop> loop_;
    std::thread thread_;
    std::string address_;
    std::vector<std::unique_ptr<test::Process>> hosts_;
};

/// Frames in a span of time, by how long after the one before they were released.
struct FrameSpan {
    std::vector<double> ms;
    double worst = 0;
    double worstStandstill = 0;  ///< of frames, left out here, during which the machine stood still
    std::size_t standstills = 0;
    std::vector<double> workMs;  ///< where somebody fills it: processor time of the frame thread in each
    [[nodiscard]] Median median() const { return medianOf(ms); }
};

/// Of the frames released in [from, to), but for those whose time holds one of `without`, and the ones before them: of
/// these `left` gets the longest, whenever they were released.
[[nodiscard]] FrameSpan spanOf(const std::vector<Instant>& released,
                               const std::vector<StandstillWatch::Standstill>& standstills, Instant from, Instant to,
                               const std::vector<Instant>& without = {}, double* left = nullptr);

/// Whether a list of names with commas between them has this one.
[[nodiscard]] inline bool isWanted(const std::string& names, const std::string& name) {
    return ("," + names + ",").find("," + name + ",") != std::string::npos;
}

/// What frames of a wall take while its guests ask for much, in groups: lies, undo, reset, copies, questions.
void guestRows(SceneTable& table, const std::string& forest, const std::string& rows, bool quick);
/// And while an application sends large arrays.
void uploadRows(SceneTable& table, bool quick);
/// What an edit of a few bytes of a large array costs.
void editRows(SceneTable& table, bool quick);

}  // namespace tessera::bench
