/// What binds a peer's bulk connection to its control connection: whoever has it may speak for that peer.
#pragma once

#include <cstdint>

#include "common/base/SystemRandom.h"

namespace tessera {

/// 128 bits that only the server and that peer know. All zero is none.
struct SessionToken {
    std::uint64_t low = 0;
    std::uint64_t high = 0;

    [[nodiscard]] constexpr explicit operator bool() const { return (low | high) != 0; }
    /// Takes as long whether the first bit differs or the last: how long a refusal takes tells nothing of a token.
    friend constexpr bool operator==(const SessionToken& a, const SessionToken& b) {
        return ((a.low ^ b.low) | (a.high ^ b.high)) == 0;
    }
};

/// A new one from the system's random source.
[[nodiscard]] inline SessionToken randomToken() {
    const Hash128 bits = systemRandom();
    return {bits.low, bits.high};
}

}  // namespace tessera
