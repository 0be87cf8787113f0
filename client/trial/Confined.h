/// Takes away from the running process what compiling and drawing does not need.
#pragma once

#include <sys/types.h>

#include "common/base/Error.h"

namespace tessera {

/// Memory, files that could be written and the parent's life: before anything else. 0: the parent does not matter.
[[nodiscard]] Expected<void> boundResources(pid_t parent);
/// Once all libraries are loaded, irrevocable: from here on no file can be opened (Landlock, where the kernel has it), no program started, no process made, nothing
/// sent over a network (seccomp), and `seconds` more of the processor are left, rounded up.
[[nodiscard]] Expected<void> confineDrawing(int seconds);

}  // namespace tessera
