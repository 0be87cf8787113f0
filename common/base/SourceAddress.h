/// Where a connection comes from, as far as it counts against others from there.
#pragma once

#include <sys/socket.h>

#include <string>

#include "common/base/StrongId.h"

namespace tessera {

/// An IPv4 address, or the first 64 bits of an IPv6 address: within those whoever has one has them all. None: unknown.
using SourceAddress = StrongId<struct SourceAddressTag>;

/// An IPv4 address within IPv6 counts as that one. Neither of both: none.
[[nodiscard]] SourceAddress sourceOf(const sockaddr& address);
/// "192.0.2.7", "2001:db8:0:1::/64"
[[nodiscard]] std::string toString(SourceAddress source);

}  // namespace tessera
