/// Lists that applications propose, until they are edits.
#pragma once

#include <cstdint>
#include <map>

#include "server/sim/desk/OpenEdits.h"

namespace tessera {

/// A proposal whose arrays came before it waits for the thread that puts them together (Uploads); then its list is
/// decoded and is an edit. Frame thread only.
class ProposalRequests {
public:
    ProposalRequests(const DeskSurroundings& around, const DeskLimits& limits, OpenEdits& edits)
        : around_(around), limits_(limits), edits_(edits) {}

    [[nodiscard]] ServerActions propose(const Asker& asker, Proposal proposal, TimePoint now);
    /// What has come for an application's next proposal is of no use.
    void dropArrays(ConnectionId connection);
    /// Arrays of an application's next proposal. Costs the same however large they are.
    void uploading(const server_action::UploadReceived& received);
    [[nodiscard]] ServerActions uploaded(UploadFinished finished, TimePoint now);

private:
    /// The arrays of its list are here.
    [[nodiscard]] ServerActions enter(std::uint64_t ticket, const Proposal& proposal, TimePoint now);
    [[nodiscard]] Expected<ChangeList> listFrom(const Proposal& proposal);

    const DeskSurroundings& around_;
    const DeskLimits& limits_;
    OpenEdits& edits_;
    std::map<std::uint64_t, std::uint64_t> awaiting_;  ///< tickets whose arrays are being put together, by upload
};

}  // namespace tessera
