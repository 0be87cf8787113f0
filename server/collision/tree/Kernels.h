/// The vector kernels for this processor.
#pragma once

#include "server/collision/mesh/InstructionSet.h"
#include "server/collision/tree/KernelTypes.h"

namespace tessera::kernel {

[[nodiscard]] const TreeKernels& treeKernels(InstructionSet set = instructionSet());

}  // namespace tessera::kernel
