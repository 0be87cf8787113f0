/// A whole server: scene, wall, journal, and the ways into it.
#pragma once

#include <functional>
#include <string>
#include <thread>

#include "common/base/Error.h"
#include "common/base/Log.h"
#include "common/base/ServiceNotifier.h"
#include "server/command/ServerCommand.h"
#include "server/sim/FrameLoop.h"

namespace tessera {

/// The process that a server runs in.
struct ServingProcess {
    Log& log;
    /// Takes lines for people and for programs that read them; on the frame thread, and on the one that looks after
    /// tokens.
    std::function<void(const std::string&)> say;
    /// Returns a thread that stops the loop when the process is told to end. It ends with the loop, when it is asked
    /// to.
    std::function<std::jthread(FrameLoop&)> watch;
    std::function<void()> threadsBegin = {};  ///< before the first thread begins; may be empty
    ServiceNotifier* service = nullptr;       ///< that watches the process; null: nobody does
};

/// Serves until all frames have been shown, or the loop is stopped. The calling thread becomes the frame thread.
/// Errors: those of the command line, of keys, panels and folders, and of FrameLoop::run.
[[nodiscard]] Expected<void> serve(const ServerArguments& arguments, const ServingProcess& process);

}  // namespace tessera
