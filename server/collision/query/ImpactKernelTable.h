/// The kernels of the time of impact for this processor.
#pragma once

#include "server/collision/mesh/InstructionSet.h"
#include "server/collision/query/ImpactKernels.h"

namespace tessera::kernel {

[[nodiscard]] const ImpactKernels& impactKernels(InstructionSet set = instructionSet());

}  // namespace tessera::kernel
