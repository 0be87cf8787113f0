/// Programs on machines that have no room for them.
#pragma once

#include <cstdio>
#include <new>
#include <system_error>

#include "common/base/Error.h"

namespace tessera {

/// Returns what `run` does: an exit code. Where the machine gives it no thread, no descriptor or no memory that is
/// said, and kFailed's is returned.
template <typename Run>
[[nodiscard]] int runProgram(const char* name, const Run& run) {
    const auto lacks = [&](const char* what) {
        std::fprintf(stderr, "%s: the machine has no room for it: %s\n", name, what);
        return exitCode(ErrorCode::kFailed);
    };
    try {
        return run();
    } catch (const std::system_error& shortage) {
        return lacks(shortage.what());
    } catch (const std::bad_alloc&) {
        return lacks("no memory is left");
    }
}

}  // namespace tessera
