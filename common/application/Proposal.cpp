#include "common/application/Proposal.h"

#include <fmt/format.h>

#include "common/codec/ChangeCodec.h"
#include "common/scene/Aspect.h"
#include "common/session/Messages.h"

namespace tessera {

Expected<Proposal> proposalOf(const ChangeList& list, std::uint64_t gesture) {
    Proposal proposal;
    std::uint64_t bytes = 0;
    std::size_t smallBytes = 0;
    for (Blob& blob : blobsOf(list)) {
        if (!blob.resident()) continue;
        bytes += blob.sizeBytes();
        if (blob.sizeBytes() <= limits::kMaxInlineArrayBytes - smallBytes) {
            smallBytes += blob.sizeBytes();
            proposal.request.blobs.push_back(blob.slice());
        } else {
            proposal.arrays.push_back(std::move(blob));
        }
    }
    if (bytes > limits::kMaxUploadBytes)
        return fail(ErrorCode::kLimit, fmt::format("the proposal has {} bytes of arrays, and {} MiB may come with one; propose them one after the other",
                                                   bytes, limits::kMaxUploadBytes >> 20));
    proposal.request.list = encodeChangeList(list);
    if (proposal.request.list.size() > limits::kMaxProposalBytes)
        return fail(ErrorCode::kLimit, fmt::format("the proposal's list has {} bytes, and {} MiB is the most; propose it in parts",
                                                   proposal.request.list.size(), limits::kMaxProposalBytes >> 20));
    proposal.request.gesture = gesture;
    return proposal;
}

}  // namespace tessera
