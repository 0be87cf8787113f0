/// What the machines of a wall lack, before anything is started on them.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "common/wall/Machine.h"
#include "deploy/wall/Signals.h"

namespace tessera {

/// A host that is to be started elsewhere, and what its client is asked to do there.
struct MachineQuestion {
    std::string host;
    Machine machine;
    std::vector<std::string> arguments;  ///< of its client, as far as `tessera-client --check` takes them
};

struct MachineAnswer {
    std::string host;
    std::string destination;         ///< ssh's
    std::vector<std::string> lacks;  ///< in words, what is in the way; empty: its client would start
    std::string seesUsAs;            ///< the address that the machine sees this one by; empty: unknown
    int cores = 0;                   ///< 0: unknown
    std::string pixels;              ///< of its test picture; empty: none was drawn
};

struct AskingOptions {
    std::string ssh;                             ///< a path
    std::string version;                         ///< what a client there has to answer to --version, to the letter
    std::chrono::milliseconds deadline{40'000};  ///< of one machine; ssh gives up after 10 s where nobody answers
    std::size_t atOnce = 32;
};

/// Asks all, some at once, and waits for what they say: as many answers, in the same order. Nothing where somebody
/// asked for the end meanwhile. A machine that talks without end, or not at all, lacks a client.
[[nodiscard]] std::optional<std::vector<MachineAnswer>> askMachines(const std::vector<MachineQuestion>& questions,
                                                                    const AskingOptions& options, Signals& signals);

}  // namespace tessera
