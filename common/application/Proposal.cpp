#include "common/application/Proposal.h"

#include <fmt/format.h>

#include "common/codec/ChangeCodec.h"
#include "common/scene/Aspect.h"
#include "common/session/Messages.h"

namespace tessera {

namespace {

/// `arrays`: that do not travel with it. `complete`: false where the server is trusted to have some.
Expected<Proposal> proposalOf(const ChangeList& list, const Proposals::Known& known, std::vector<Blob>& arrays,
                              bool& complete) {
    Proposal proposal;
    complete = true;
    std::uint64_t bytes = 0;
    std::size_t smallBytes = 0;
    for (Blob& blob : blobsOf(list)) {
        if (!blob.resident()) continue;
        if (known && known(blob.id())) {
            complete = false;
            continue;
        }
        bytes += blob.sizeBytes();
        if (blob.sizeBytes() <= limits::kMaxInlineArrayBytes - smallBytes) {
            smallBytes += blob.sizeBytes();
            proposal.blobs.push_back(blob.slice());
        } else {
            arrays.push_back(std::move(blob));
        }
    }
    if (bytes > limits::kMaxUploadBytes)
        return fail(
            ErrorCode::kLimit,
            fmt::format(
                "the proposal has {} bytes of arrays, and {} MiB may come with one; propose them one after the other",
                bytes, limits::kMaxUploadBytes >> 20));
    proposal.list = encodeChangeList(list);
    if (proposal.list.size() > limits::kMaxProposalBytes)
        return fail(ErrorCode::kLimit,
                    fmt::format("the proposal's list has {} bytes, and {} MiB is the most; propose it in parts",
                                proposal.list.size(), limits::kMaxProposalBytes >> 20));
    return proposal;
}

}  // namespace

Expected<answer::Committed> Proposals::propose(const ChangeList& list, std::uint64_t gesture, const Known& known,
                                               const Ask& ask) {
    Known has = [&](const BlobId& id) { return taken_.find(id).resident() || known(id); };
    while (true) {
        std::vector<Blob> arrays;
        bool complete = true;
        Expected<Proposal> proposal = proposalOf(list, has, arrays, complete);
        if (!proposal) return tl::unexpected(proposal.error());
        proposal->gesture = gesture;
        Expected<answer::Committed> committed = ask(*proposal, arrays);
        if (!committed && !complete && committed.error().code == ErrorCode::kNotFound) {
            has = nullptr;
            continue;
        }
        if (committed)
            for (const Blob& array : blobsOf(list)) (void)taken_.add(array);
        return committed;
    }
}

}  // namespace tessera
