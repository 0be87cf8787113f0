/// Which machines may say something: addresses, and ranges of them.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "common/base/Error.h"

namespace tessera {

/// An IP address as 16 bytes; IPv4 as IPv6 writes it (::ffff:a.b.c.d), so that a socket of either kind means the same.
using HostBytes = std::array<std::uint8_t, 16>;

/// All addresses that share the first `bits` with `first`.
struct HostRange {
    HostBytes first{};
    int bits = 128;
    [[nodiscard]] bool contains(const HostBytes& host) const;
};

/// "10.0.0.5", "10.0.0.0/24", "fd00::/8". Names are not looked up. kBadInput.
[[nodiscard]] Expected<HostRange> parseHostRange(std::string_view text);

}  // namespace tessera
