/// Takes away from the running process whatever reading a file does not need.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <string>

#include "common/base/Error.h"

namespace tessera {

struct Confinement {
    std::string file;  ///< absolute, without symbolic links; its folder stays readable
    std::size_t memoryBytes = std::size_t{2} << 30;
    std::chrono::seconds cpuTime{10};
    std::chrono::seconds cpuTimePerMebibyte{0};  ///< see `grantTimeFor`
    std::chrono::seconds mostCpuTime{0};         ///< with all that was granted; less than `cpuTime` is as much as that
    pid_t parent = 0;  ///< dies with this process; 0: does not matter
    bool allowUnconfined = false;
};

/// Irrevocable. Afterwards: memory and processor time are bounded, no file can be written and none outside of the
/// folder read (Landlock), no network, no new process or thread, no program started, no code loaded (seccomp).
/// kUnsupported where the system lacks Landlock or seccomp and `allowUnconfined` is not set; the bounds hold even then.
[[nodiscard]] Expected<void> confine(const Confinement& confinement);

/// Whoever has read so many bytes of a file has more time to make something of them. Before `confine`, and without it: nothing.
void grantTimeFor(std::size_t bytes);

}  // namespace tessera
