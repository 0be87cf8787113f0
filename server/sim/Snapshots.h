/// The whole scene for those who join: hosts, applications, and replicas to be repaired.
#pragma once

#include <memory>
#include <vector>

#include "common/session/ServerSession.h"
#include "server/sim/frame/Simulation.h"

namespace tessera {

/// Until there is a scene, whoever asks waits.
class Snapshots {
public:
    Snapshots(const Simulation& simulation, ServerSession& session) : simulation_(simulation), session_(session) {}

    [[nodiscard]] ServerActions wanted(ConnectionId connection, TimePoint now);
    /// The scene is there: gives it to all who wait.
    [[nodiscard]] ServerActions sceneReady(TimePoint now);

private:
    [[nodiscard]] ServerActions give(ConnectionId connection, TimePoint now);

    const Simulation& simulation_;
    ServerSession& session_;
    /// While somebody is being sent it, whoever joins gets the same: a scene is encoded once, however many come.
    std::weak_ptr<const CommittedList> last_;
    bool ready_ = false;
    std::vector<ConnectionId> waiting_;
};

}  // namespace tessera
