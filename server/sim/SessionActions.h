/// What the session's actions mean on the server.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>

#include "common/base/Log.h"
#include "server/programs/ProgramTrials.h"
#include "server/sim/FramePacing.h"
#include "server/sim/desk/RequestDesk.h"
#include "server/sim/peers/Peers.h"
#include "server/sim/records/Snapshots.h"
#include "server/sim/records/StateComparison.h"
#include "server/sim/report/Report.h"

namespace tessera {

/// What a step of the walk down a replica's hash tree has found (StateComparison), on the thread of `Snapshots`.
struct StateCompared {
    std::string host;
    std::uint64_t walk = 0;
    StateComparison::Step step;
};

/// Carries out actions and all that follows from them, in order. Frame thread only.
class SessionActions {
public:
    /// All outlive it.
    struct Surroundings {
        const TimeSource& time;
        Peers& peers;
        FramePacing& pacing;
        Snapshots& snapshots;
        RequestDesk& desk;
        Steering& steering;
        Report& report;
        FrameBudget& budget;
        ExposureMeter& exposure;
        ProgramTrials& programs;
        Log& log;
        const std::function<void(std::uint64_t framesReleased)> onReleased;
        /// What the desk says to a request passes through it on its way out; may be empty.
        const std::function<ServerActions(ServerActions)> onAnswered = {};
        const std::function<void(Epoch)> onEpochRaised = {};  ///< may be empty
        /// Called by another thread; what it hands over comes back by `compared`.
        const std::function<void(StateCompared)> deliver = {};
    };
    explicit SessionActions(Surroundings around) : around_(std::move(around)) {}

    void carryOut(ServerActions actions);
    void compared(const StateCompared& found);

private:
    // One for each action, with what follows from it; one that is missing does not compile.
    ServerActions on(const server_action::Send&) { return {}; }  // these three Peers has done by then
    ServerActions on(const server_action::Close&) { return {}; }
    ServerActions on(const server_action::BlobRequested&) { return {}; }
    ServerActions on(const server_action::SnapshotWanted&);
    ServerActions on(const server_action::HostEntered&);
    ServerActions on(const server_action::Fault&);
    ServerActions on(const server_action::FrameReleased&);
    ServerActions on(const server_action::FrameStats&);
    ServerActions on(const server_action::FrameShown&);
    ServerActions on(const server_action::StateMismatch&);
    ServerActions on(const server_action::HashesReceived&);
    ServerActions on(const server_action::RequestReceived&);
    ServerActions on(const server_action::ApplicationJoined&);
    ServerActions on(const server_action::ApplicationLeft&);
    ServerActions on(const server_action::BlobsEverywhere&);
    ServerActions on(const server_action::ImageReceived&);
    ServerActions on(const server_action::PixelsDiffer&);
    ServerActions on(const server_action::EpochRaised&);
    ServerActions on(const server_action::InputReceived&);
    ServerActions on(const server_action::InputEnded&);
    ServerActions on(const server_action::UploadReceived&);
    ServerActions on(const server_action::LoginsSlowed&);

    Surroundings around_;
    struct Walk {
        std::uint64_t number = 0;  ///< what an earlier one of the host still finds is nothing any more
        std::shared_ptr<StateComparison> comparison;  ///< that thread's, once it is under way
    };
    std::map<std::string, Walk> walks_;  ///< by host: at most one each, and one leaf of hashes with it
    std::uint64_t lastWalk_ = 0;
};

}  // namespace tessera
