/// Whether the other end of a connection has reset it.
#pragma once

#include <poll.h>

namespace tessera {

/// Who has said its last word still waits for ours, and has not. Of a socket that is closed here the answer counts for
/// nothing: its number may be another's.
[[nodiscard]] inline bool hasHungUp(int socket) {
    pollfd state{socket, 0, 0};
    return ::poll(&state, 1, 0) > 0 && (state.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0;
}

}  // namespace tessera
