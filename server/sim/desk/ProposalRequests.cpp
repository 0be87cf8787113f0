#include "server/sim/desk/ProposalRequests.h"

#include <utility>

#include <fmt/format.h>

#include "common/codec/ChangeCodec.h"

namespace tessera {

ServerActions ProposalRequests::propose(const Asker& asker, Proposal proposal, TimePoint now) {
    const Expected<Uploads::Closed> upload =
        around_.uploads ? around_.uploads->close(asker.connection) : Uploads::Closed();
    if (!upload) return around_.answers().to(asker, failWith("proposal", upload.error()));
    const std::uint64_t ticket = edits_.newTicket();
    std::size_t bytes = proposal.list.size() + upload->bytes;
    for (const ByteSlice& blob : proposal.blobs) bytes += blob.size();
    edits_.open(ticket, {.asker = asker,
                         .edit = {.ticket = ticket, .gesture = {asker.connection.value, proposal.gesture}},
                         .bytes = bytes});
    if (upload->upload == 0) return enter(ticket, proposal, now);
    awaiting_[upload->upload] = ticket;
    edits_.find(ticket)->proposal = std::move(proposal);
    return {};
}

ServerActions ProposalRequests::enter(std::uint64_t ticket, const Proposal& proposal, TimePoint now) {
    Expected<ChangeList> list = listFrom(proposal);
    if (!list) return edits_.refuse(ticket, list.error());
    std::vector<Blob> named = blobsOf(*list);
    edits_.find(ticket)->edit.list = std::move(*list);
    return edits_.queue(ticket, std::move(named), now);
}

Expected<ChangeList> ProposalRequests::listFrom(const Proposal& proposal) {
    std::size_t bytes = 0;
    for (const ByteSlice& blob : proposal.blobs) bytes += blob.size();
    if (bytes > limits_.maxInlineArrayBytes)
        return fail(ErrorCode::kLimit, fmt::format("proposal: arrays of {} bytes beside its list; {} may be there, "
                                                   "larger ones come before it in pieces",
                                                   bytes, limits_.maxInlineArrayBytes));
    std::vector<Blob> uploads;  // keeps them findable until the list holds them
    for (const ByteSlice& blob : proposal.blobs)
        uploads.push_back(around_.blobs.add(Blob(Bytes(blob.begin(), blob.end()))));
    Expected<ChangeList> list =
        decodeChangeList(proposal.list, around_.blobs, AbsentBlobs::kRefuse,
                         {.maxBytes = limits_.maxProposalBytes, .maxChanges = limits_.maxProposalChanges});
    if (!list) return failWith("proposal", list.error());
    if (const std::size_t weight = weightOf(*list); weight > limits_.maxProposalChanges)
        return fail(ErrorCode::kLimit, fmt::format("proposal: {} changes and references in lists; {} may be there",
                                                   weight, limits_.maxProposalChanges));
    return list;
}

void ProposalRequests::dropArrays(ConnectionId connection) {
    if (around_.uploads) around_.uploads->drop(connection);
}

void ProposalRequests::uploading(const server_action::UploadReceived& received) {
    if (around_.uploads) around_.uploads->take(received.connection, received.upload);
}

ServerActions ProposalRequests::uploaded(UploadFinished finished, TimePoint now) {
    const auto awaiting = awaiting_.extract(finished.upload);
    const std::uint64_t ticket = awaiting ? awaiting.mapped() : 0;
    OpenEdits::Open* const open = awaiting ? edits_.find(ticket) : nullptr;
    if (!open) {
        around_.uploads->handedOver(finished.upload);
        if (finished.blobs) around_.uploads->letGo(std::move(*finished.blobs));
        return {};
    }
    open->upload = finished.upload;
    if (!finished.blobs) return edits_.refuse(ticket, failWith("proposal", finished.blobs.error()).value());
    // Findable until the list holds them.
    for (Blob& blob : *finished.blobs) blob = around_.blobs.add(std::move(blob));
    ServerActions actions = enter(ticket, std::exchange(open->proposal, {}), now);
    around_.uploads->letGo(std::move(*finished.blobs));
    return actions;
}

}  // namespace tessera
