/// Takes away from the running process whatever decoding a film that is open does not need.
#pragma once

#include <sys/types.h>

#include "common/base/Error.h"

namespace tessera {

/// Irrevocable. Afterwards: 2 GiB of memory, no file can be opened, nothing sent over a network, no process, thread or program started, no code loaded, no signal
/// sent but to itself (seccomp: what is not named does not exist; Landlock besides, where the kernel has it); the process ends with `parent` (0: does not matter).
/// kUnsupported where the system has no seccomp.
[[nodiscard]] Expected<void> confineDecoder(pid_t parent);

}  // namespace tessera
