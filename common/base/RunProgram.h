/// Programs on machines that have no room for them.
#pragma once

#include <cstdio>
#include <new>
#include <stdexcept>
#include <system_error>

#include "common/base/Error.h"
#include "common/base/Shortage.h"

namespace tessera {

/// Returns what `run` does: an exit code. Where the machine gives it no thread, no descriptor or no memory, or refuses
/// another call that has to succeed, that is said, and kFailed's is returned.
template <typename Run>
[[nodiscard]] int runProgram(const char* name, const Run& run) {
    const auto ends = [&](const char* why, const char* what) {
        std::fprintf(stderr, "%s: %s: %s\n", name, why, what);
        return exitCode(ErrorCode::kFailed);
    };
    constexpr const char* kNoRoom = "the machine has no room for it";
    try {
        return run();
    } catch (const std::system_error& refused) {
        const bool isGeneric =
            refused.code().category() == std::generic_category() || refused.code().category() == std::system_category();
        return ends(isGeneric && isShortage(refused.code().value()) ? kNoRoom : "it cannot go on", refused.what());
    } catch (const std::bad_alloc&) {
        return ends(kNoRoom, "no memory is left");
    } catch (const std::runtime_error& refused) {  // Boost's system_error is one
        return ends("it cannot go on", refused.what());
    }
}

}  // namespace tessera
