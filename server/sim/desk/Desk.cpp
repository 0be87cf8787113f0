#include "server/sim/desk/Desk.h"

#include <fmt/format.h>

#include "common/request/Check.h"

namespace tessera {

std::optional<Error> Desk::mayNot(ConnectionId connection, const RequestInfo& info) const {
    const auto known = applications.find(connection);
    const Role role = known == applications.end() ? Role::kViewer : known->second.role;
    if (role >= info.role) return std::nullopt;
    return roleRefusal(info, role);
}

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
