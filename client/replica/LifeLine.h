/// Ends a client whose starter is gone: `tessera-client --while-input`.
#pragma once

#include <chrono>
#include <functional>
#include <thread>

#include "common/base/Error.h"
#include "common/base/FileHandle.h"
#include "common/base/Log.h"

namespace tessera {

/// While it lives a thread reads the standard input, whose bytes mean nothing. Where that ends, or is silent for longer
/// than `patience` (a cable was cut, and nobody says so), the process ends at once with the exit code of a lost
/// connection, whatever its other threads do, even where one hangs.
///
/// Over ssh a cut connection ends the input, and nothing else: without this a client would draw for a server that
/// nobody can reach, until somebody came by.
class LifeLine {
public:
    /// `cleanUp`: on that thread, before the process ends. Not without the two handles that the system gives it:
    /// kFailed.
    [[nodiscard]] static Expected<LifeLine> hold(std::chrono::seconds patience, std::function<void()> cleanUp,
                                                 Log& log);
    ~LifeLine();
    LifeLine(LifeLine&&) = default;
    LifeLine& operator=(LifeLine&&) = delete;

private:
    LifeLine() = default;
    FileHandle stop_;  ///< written to when the process goes its own way
    std::thread reader_;
};

}  // namespace tessera
