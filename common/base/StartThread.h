/// Threads on machines that may have no room for another one.
#pragma once

#include <system_error>
#include <thread>
#include <utility>

namespace tessera {

/// One that does not run (`joinable()` is false) where the machine refuses it. While others run a program goes on
/// without it; one that it cannot do without it starts by `std::thread`.
template <typename Work>
[[nodiscard]] std::thread startThread(Work&& work) {
    try {
        return std::thread(std::forward<Work>(work));
    } catch (const std::system_error&) {
        return {};
    }
}
/// For messages.
inline constexpr const char* kNoThread = "the machine has no room for another thread at present";

}  // namespace tessera
