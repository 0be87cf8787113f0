/// What the session's actions mean on the server.
#pragma once

#include <functional>

#include "common/base/Log.h"
#include "server/programs/ProgramTrials.h"
#include "server/sim/FramePacing.h"
#include "server/sim/Peers.h"
#include "server/sim/Report.h"
#include "server/sim/Snapshots.h"
#include "server/sim/StateComparison.h"
#include "server/sim/desk/RequestDesk.h"

namespace tessera {

class Simulation;

/// Carries out actions and all that follows from them, in order. Frame thread only.
class SessionActions {
public:
    /// All outlive it.
    struct Surroundings {
        Peers& peers;
        FramePacing& pacing;
        Snapshots& snapshots;
        RequestDesk& desk;
        Steering& steering;
        const Simulation& simulation;
        Report& report;
        FrameBudget& budget;
        ProgramTrials& programs;
        Log& log;
        const std::function<void(std::uint64_t framesReleased)> onReleased;
        /// What the desk says to a request passes through it on its way out; may be empty.
        const std::function<ServerActions(ServerActions)> onAnswered = {};
        const std::function<void(Epoch)> onEpochRaised = {};  ///< may be empty
    };
    explicit SessionActions(Surroundings around) : around_(std::move(around)) {}

    void carryOut(ServerActions actions);

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

    Surroundings around_;
    StateComparison comparison_;
};

}  // namespace tessera
