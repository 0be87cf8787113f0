/// How a list becomes a proposal: what goes with it, and what before it. Inside of the library only.
#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include "common/base/Blob.h"
#include "common/base/Error.h"
#include "common/change/ChangeList.h"
#include "common/request/EditRequests.h"

namespace tessera {

/// Makes proposals without the arrays that the server has as far as anybody knows here: it took them in an earlier
/// proposal, or sent them itself. Only those count that are still in memory. Where it has let go of them since, it
/// refuses the list, and is sent all of them.
class Proposals {
public:
    using Known = std::function<bool(const BlobId&)>;
    /// Asks the server; `arrays` are uploaded first.
    using Ask = std::function<Expected<answer::Committed>(const Proposal&, std::span<const Blob> arrays)>;
    /// kLimit: more than the server takes (`limits` in common/session/Messages.h). `known`: it has sent this array.
    [[nodiscard]] Expected<answer::Committed> propose(const ChangeList& list, std::uint64_t gesture, const Known& known,
                                                      const Ask& ask);

private:
    BlobStore taken_;  ///< arrays of proposals that were committed
};

}  // namespace tessera
