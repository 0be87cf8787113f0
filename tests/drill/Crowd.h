/// Ten thousand connections that mean nothing: half of them say nothing, half begin a handshake and stop.
#pragma once

#include <csignal>
#include <cstdint>
#include <string>

namespace tessera::drill {

inline constexpr std::size_t kCrowd = 10'000;

struct CrowdCount {
    std::uint64_t most = 0;    ///< that stood open at once
    std::uint64_t came = 0;    ///< connections that were opened
    std::uint64_t closed = 0;  ///< of them, by the other side
    std::uint64_t failed = 0;  ///< dials that came to nothing
};

/// Dials `address` with kCrowd sockets, and again with each that is closed, until `over`. Fails where this process may
/// not have so many: nothing was dialled then.
[[nodiscard]] bool standAround(const std::string& address, const volatile std::sig_atomic_t& over, CrowdCount& count);

}  // namespace tessera::drill
