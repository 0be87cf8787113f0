/// What is wrong with what somebody says: the bounds of its description, told with the member's name. Who says it asks
/// before it is sent, and who hears it asks again.
#pragma once

#include <optional>
#include <string>

#include "common/base/Error.h"
#include "common/request/Members.h"

namespace tessera {

struct Description;

/// "at least 0", "from 0.1 to 60000, or 0".
[[nodiscard]] std::string textOf(const NumberBounds& bounds);

/// "ProposeEdit is for an editor; this link is of a viewer"
[[nodiscard]] Error roleRefusal(const RequestInfo& info, Role role);

/// kBadInput: numbers out of their bounds or none at all, quaternions that tell no rotation; kUnsupported: words that
/// this version does not know; kLimit: too long, or too many. It tells the first fault in the order of the members.
[[nodiscard]] std::optional<Error> findFault(const Description& description, const void* value,
                                             const ApplicationLimits& limits = {});

/// The same for a request, by its number. Its name stands in front: "REQUEST: budget_ms must be at least 0, not -3".
[[nodiscard]] Expected<void> checkRequest(std::uint8_t number, const void* request);
template <typename Request>
[[nodiscard]] Expected<void> checkRequest(const Request& request) {
    return checkRequest(Request::kInfo.number, &request);
}

}  // namespace tessera
