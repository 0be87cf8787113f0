/// What a machine has no room for at present: threads, descriptors, memory. Another time the same may go.
#pragma once

#include <cerrno>
#include <utility>

namespace tessera {

/// Whether that is what an errno says.
[[nodiscard]] inline bool isShortage(int systemError) {
    return systemError == EAGAIN || systemError == EMFILE || systemError == ENFILE || systemError == ENOMEM;
}

/// What this thread met on its way, for whoever tries the whole again: errors say in words what was wrong, and a
/// shortage may lie deep below.
inline thread_local bool metShortage = false;
inline void noteFailedCall(int systemError) {
    metShortage = metShortage || isShortage(systemError);
}
/// Whether the calling thread has met one since the last call.
[[nodiscard]] inline bool takeMetShortage() {
    return std::exchange(metShortage, false);
}

}  // namespace tessera
