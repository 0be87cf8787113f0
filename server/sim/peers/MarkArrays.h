/// The arrays of the display of contacts, of handles and of notices, at every host before anybody asks for them.
#pragma once

#include <limits>
#include <span>
#include <vector>

#include "common/base/Blob.h"
#include "common/session/ServerSession.h"

namespace tessera {

/// The display comes and goes in the middle of frames: every host has its arrays before it enters the barrier, whether
/// or not they are ever shown.
class MarkArrays {
public:
    /// Keeps the arrays findable for hosts that fetch them.
    MarkArrays(BlobStore& blobs, ServerSession& session);

    [[nodiscard]] ServerActions announce(TimePoint now);
    /// After a frame whose list names these blobs. The session forgets what a list has named; the display may go, a
    /// host join, and the display come back: then they are announced again.
    [[nodiscard]] ServerActions named(std::span<const BlobInfo> blobs, TimePoint now);

private:
    ServerSession& session_;
    const std::vector<Blob> arrays_;
    std::uint64_t token_ = std::numeric_limits<std::uint64_t>::max();  ///< the desk's tokens count up, ours down
};

}  // namespace tessera
