/// A proposal as it travels: what goes with its list, and what before it. Inside of the library only.
#pragma once

#include <cstdint>
#include <vector>

#include "common/base/Blob.h"
#include "common/base/Error.h"
#include "common/change/ChangeList.h"
#include "common/codec/ApplicationCodec.h"

namespace tessera {

struct Proposal {
    request::Propose request;
    std::vector<Blob> arrays;  ///< that are uploaded first
};
/// kLimit: more than the server takes (`limits` in common/session/Messages.h).
[[nodiscard]] Expected<Proposal> proposalOf(const ChangeList& list, std::uint64_t gesture);

}  // namespace tessera
