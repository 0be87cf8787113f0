#include "server/sim/desk/Desk.h"

#include <fmt/format.h>

namespace tessera {

std::optional<Error> Desk::tooManyOpen(ConnectionId connection) const {
    const OpenEdits::Count open = edits.countOf(connection);
    const std::size_t count = open.edits + images.openCount(connection) + views.openCount(connection);
    if (count >= limits.maxOpenRequests)
        return Error{ErrorCode::kLimit,
                     fmt::format("{} requests of this application are open already; try again later", count)};
    if (open.bytes >= limits.maxOpenBytes)
        return Error{ErrorCode::kLimit, fmt::format("proposals of {} MiB of this application wait already; "
                                                    "try again later",
                                                    open.bytes >> 20)};
    return std::nullopt;
}

}  // namespace tessera
